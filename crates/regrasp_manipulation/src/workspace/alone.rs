//! Tests of one or two fingers, whatever the others do.

use crate::model::Carrier;
use crate::workspace::{TipMode, Workspace};
use regrasp_robot::kinematics::finger_ik::Coordinates;

impl Workspace<'_> {
    /// True when one finger is clear of the object, the palm and obstacles now, whatever the other fingers do.
    pub fn finger_alone_is_clear(&mut self, finger: usize, mode: TipMode) -> bool {
        self.stand();
        let moving = &self.model.fingers[finger];
        self.is_within_reach(Some(finger))
            && self.in_turn(moving.pairs.len(), &moving.turns, mode, |this, k| {
                let pair = moving.pairs[k];
                this.is_between_fingers(pair) || this.pair_is_clear(pair, mode)
            })
    }

    /// True when the object is clear of the palm now, whatever the fingers do.
    pub fn palm_is_clear(&mut self) -> bool {
        self.stand();
        let model = self.model;
        let is_of_palm = |body: usize| matches!(model.bodies[body].carrier, Carrier::World);
        let pairs =
            (0..model.pairs.len()).filter(|&k| is_of_palm(model.pairs[k].a) && model.pairs[k].b == model.object);
        pairs.into_iter().all(|pair| self.pair_is_clear(pair, TipMode::AllHold))
    }

    /// True when two fingers with these joints are clear of each other.
    pub fn fingers_are_clear(&mut self, first: (usize, &Coordinates), second: (usize, &Coordinates)) -> bool {
        let model = self.model;
        let (f, g) = (first.0.min(second.0), first.0.max(second.0));
        self.set_finger(first.0, first.1);
        self.set_finger(second.0, second.1);
        self.stand();
        self.forget_slack();
        model.fingers[f].pairs_with[g].iter().all(|&pair| self.pair_is_clear(pair, TipMode::AllHold))
    }

    fn is_between_fingers(&self, pair: usize) -> bool {
        let pair = &self.model.pairs[pair];
        match (&self.model.bodies[pair.a].carrier, &self.model.bodies[pair.b].carrier) {
            (Carrier::Finger { finger: f, .. }, Carrier::Finger { finger: g, .. }) => f != g,
            _ => false,
        }
    }
}
