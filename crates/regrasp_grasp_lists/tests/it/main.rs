//! Lists of bundled and real hands: the checker accepts them and none that is broken, and threads change nothing.

mod driven;
mod lists;
mod mutants;
mod sample;
mod two_lists;
