//! The checker: starts from files, shares no decision with the planner.
