//! Lists of real hands and objects.
