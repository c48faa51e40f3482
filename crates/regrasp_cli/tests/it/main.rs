//! The command line from outside: one test binary.

mod bad_input;
mod commands;
mod folder;
