//! Readers: URDF, SRDF, `package://` paths, hand files.
