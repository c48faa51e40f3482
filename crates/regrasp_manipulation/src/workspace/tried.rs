//! Contacts that fingers can bring their tips to, and what is in the way there.

use crate::model::{Model, Pair};
use regrasp_robot::inspect::tip_report;
use std::collections::BTreeMap;

/// A finger with fewer contacts tried is not told about.
const FEWEST: u64 = 40;
/// A pair that is in the way of this share of a finger's contacts is told.
const SHARE: f64 = 0.7;
/// What helps against tips that are smaller than their links.
const TIPS_THAT_FIT: &str = "let `regrasp inspect` on the URDF write fingertips that nothing stands out of, or shrink the links' collision \
     geometry where it is larger than the links";
/// What helps where the tips are as they should be.
const ANOTHER_POSE: &str = "move the start pose to where fingertips touch the object first (`regrasp place` looks for such a pose), scale the \
     object to the sizes that `regrasp inspect` names, or shrink the links' collision geometry where it is larger than the links";

/// Contacts tried, and those at which two bodies were too near.
#[derive(Debug, Clone, Default)]
pub struct Tried {
    /// By finger.
    contacts: BTreeMap<usize, u64>,
    /// By finger and pair.
    blocked: BTreeMap<(usize, Pair), u64>,
}

impl Tried {
    /// One more contact of `finger`, and the pair that is too near there, if one is.
    pub fn add(&mut self, finger: usize, blocked_by: Option<Pair>) {
        *self.contacts.entry(finger).or_default() += 1;
        if let Some(pair) = blocked_by {
            *self.blocked.entry((finger, pair)).or_default() += 1;
        }
    }

    /// Adds what another has counted.
    pub fn merge(&mut self, other: &Tried) {
        for (&finger, count) in &other.contacts {
            *self.contacts.entry(finger).or_default() += count;
        }
        for (&key, count) in &other.blocked {
            *self.blocked.entry(key).or_default() += count;
        }
    }

    /// What is most often in `finger`'s way at the contacts tried, in words; None where few were tried or nothing was in the way.
    pub fn most_in_the_way(&self, model: &Model, finger: usize) -> Option<String> {
        let tried = *self.contacts.get(&finger)?;
        let of_finger = self.blocked.iter().filter(|((f, _), _)| *f == finger);
        let ((_, pair), count) = of_finger.max_by_key(|(key, count)| (**count, std::cmp::Reverse(*key)))?;
        let [a, b] = [pair.a, pair.b].map(|body| &model.bodies[body].name);
        let share = 100.0 * *count as f64 / tried as f64;
        (tried >= FEWEST)
            .then(|| format!("\"{a}\" and \"{b}\" meet at {share:.0} % of the {tried} contacts that it reaches"))
    }

    /// The links of fingers that touch the object before their tips do, at most contacts, in words; None where there are none.
    pub fn in_words(&self, model: &Model) -> Option<String> {
        let told: Vec<String> = self
            .in_the_way(model)
            .map(|(_, pair, tried, share)| {
                let body = &model.bodies[pair.a].name;
                let behind = if pair.tip_of.is_some() { "touches it beside its tip" } else { "is in the way" };
                format!("\"{body}\" {behind} at {:.0} % of the {tried} contacts tried", 100.0 * share)
            })
            .collect();
        (!told.is_empty()).then(|| format!("links touch the object before fingertips do: {}", told.join(", ")))
    }

    /// What would help against links that touch the object before fingertips do: other tips only where collision geometry stands out of those
    /// that the hand file declares.
    pub fn advice(&self, model: &Model) -> &'static str {
        let hand = model.view.hand;
        let stands_out = |(finger, pair, ..): (usize, Pair, u64, f64)| {
            pair.tip_of.is_some() && !tip_report(hand, &hand.fingers[finger]).stands_out.is_empty()
        };
        match self.in_the_way(model).any(stands_out) {
            true => TIPS_THAT_FIT,
            false => ANOTHER_POSE,
        }
    }

    /// Finger, pair, contacts tried and share of them, of the links of fingers that touch the object before their tips do at most contacts.
    fn in_the_way<'a>(&'a self, model: &'a Model) -> impl Iterator<Item = (usize, Pair, u64, f64)> + 'a {
        self.blocked.iter().filter_map(move |(&(finger, pair), &count)| {
            let tried = *self.contacts.get(&finger)?;
            let is_own = model.fingers[finger].bodies.contains(&pair.a) && pair.b == model.object;
            let share = count as f64 / tried as f64;
            (is_own && tried >= FEWEST && share >= SHARE).then_some((finger, pair, tried, share))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::PhysicsSettings;
    use regrasp_robot::LoadOptions;
    use regrasp_robot::tip::TipShape;
    use regrasp_scene::load_scene;

    /// A tip link that is in the way: another pose helps, and other tips only where the declared one is smaller than its link.
    #[test]
    fn other_tips_are_advised_only_where_the_link_stands_out_of_its_tip() {
        let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenes/sphere_90x.toml");
        let mut loaded = load_scene(&path, &LoadOptions::default()).unwrap();
        let advice = |loaded: &regrasp_scene::LoadedScene| {
            let view = loaded.view();
            let model = Model::new(&view, &PhysicsSettings::default());
            let pair = *model.pairs.iter().find(|pair| pair.tip_of == Some(0)).expect("the tip's link and the object");
            let mut tried = Tried::default();
            (0..FEWEST).for_each(|_| tried.add(0, Some(pair)));
            assert!(tried.in_words(&model).expect("it is always in the way").contains("beside its tip"));
            tried.advice(&model)
        };
        assert_eq!(advice(&loaded), ANOTHER_POSE);
        let TipShape::Sphere { radius } = &mut loaded.scene.hands[0].hand.fingers[0].tip.shape else { panic!() };
        *radius -= 0.001;
        assert_eq!(advice(&loaded), TIPS_THAT_FIT);
    }
}
