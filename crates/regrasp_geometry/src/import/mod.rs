//! Readers of mesh files: STL and OBJ.
