//! Exports, read back by other means than they were written with.

mod mjcf;
mod npz;
mod ros2;
mod sample;
