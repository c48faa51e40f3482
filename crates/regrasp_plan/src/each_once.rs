//! Reading JSON objects in which every key stands once: of a key that stands twice readers would differ in what they take.

use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::fmt::{self, Display};
use std::marker::PhantomData;

/// For every object, who holds it. Errors: an object named twice.
pub fn holders<'de, D: Deserializer<'de>, K, V>(deserializer: D) -> Result<BTreeMap<K, Vec<V>>, D::Error>
where
    K: Deserialize<'de> + Ord + Display,
    V: Deserialize<'de>,
{
    let expected = "names of objects, each with a list of those that hold it";
    deserializer.deserialize_map(Entries { expected, read: PhantomData })
}

/// Positions by the names of joints. Errors: a joint named twice.
pub fn positions<'de, D: Deserializer<'de>>(deserializer: D) -> Result<BTreeMap<String, f64>, D::Error> {
    deserializer.deserialize_map(Entries { expected: "names of joints, each with a position", read: PhantomData })
}

struct Entries<K, V> {
    expected: &'static str,
    read: PhantomData<(K, V)>,
}

impl<'de, K: Deserialize<'de> + Ord + Display, V: Deserialize<'de>> Visitor<'de> for Entries<K, V> {
    type Value = BTreeMap<K, V>;

    fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(self.expected)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
        let mut found = BTreeMap::new();
        while let Some((key, value)) = map.next_entry::<K, V>()? {
            if found.contains_key(&key) {
                return Err(A::Error::custom(format!("duplicate field `{key}`")));
            }
            found.insert(key, value);
        }
        Ok(found)
    }
}
