//! Tests of pick and place.
