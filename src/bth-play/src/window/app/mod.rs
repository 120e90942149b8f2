//! The window: its state, what its keys and the pointer change, and how it is drawn.

mod actions;
mod drawing;
mod events;
mod state;

pub(super) use state::App;
