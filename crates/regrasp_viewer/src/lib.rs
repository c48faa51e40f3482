//! Pictures of plans: one self-contained page, storyboards and charts. Reads scene and plan only.
