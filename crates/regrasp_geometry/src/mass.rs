//! Volume, centre of mass and inertia of solids.
