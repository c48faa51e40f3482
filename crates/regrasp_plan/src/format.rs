//! Reading and writing `plan.json`, and its JSON Schema.
