# The verbs of this repository. `just --list` shows them.

# Build the programs and the C library.
build:
    cargo build --release -p bthc -p bth-play -p bth-capi

# Run every check; `just test --quick` leaves out the slow ones.
test *options:
    tools/test {{options}}

# Compare two libraries on models: just bench old.so new.so gyroid hall
bench old new *models:
    cargo run --release -p bth-bench -- compare {{old}} {{new}} {{models}}

# Build the API documentation.
docs:
    cargo doc --no-deps --workspace --exclude bth-tetgen

# Build the documentation site into target/book; needs mdbook. `just book serve` shows it.
book verb="build":
    mdbook {{verb}}

# Find spelling mistakes; needs typos.
spell:
    typos

# Install the libraries and headers for C and C++ below a folder.
package folder:
    tools/package/install {{folder}}
