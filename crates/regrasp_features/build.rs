//! Nothing to do: without this file Cargo leaves out the build dependencies, and their features.

fn main() {}
