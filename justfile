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

# Build the site into target/book; needs mdbook (`just site --install`).
site *options:
    tools/site {{options}}

# Find spelling mistakes; needs typos.
spell:
    typos

# Build what a release uploads into a folder, and try it.
package folder:
    tools/package/all {{folder}}
