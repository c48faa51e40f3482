//! How far tips may be from where they rest: what `hand.reach` of the scene says.

use crate::workspace::Workspace;
use regrasp_robot::kinematics::finger_ik::Coordinates;

impl Workspace<'_> {
    /// True when the tips that move in the step from `now` to `next` stay as near to where they rest as the scene wants: the way of
    /// a tip strays from the line between its ends by no more than its bound says, and the line stays in the ball.
    pub(super) fn is_within_reach(&mut self, moving: Option<usize>) -> bool {
        let model = self.model;
        let Some(reach) = model.view.reach else { return true };
        let stays = |finger: usize| {
            let (tip, ends) = (&model.fingers[finger], [&self.now.joints[finger], &self.next.joints[finger]]);
            let change: Coordinates = ends[0].iter().zip(ends[1]).map(|(a, b)| (b - a).abs()).collect();
            let allowed = reach - tip.tip_bound.chord_deviation(&change);
            ends.iter().all(|joints| (tip.ik.tip(joints) - tip.tip_at_rest).norm() <= allowed)
        };
        let is_within = match moving {
            Some(finger) => stays(finger),
            None => (0..model.n_fingers()).all(stays),
        };
        if !is_within {
            self.blocking_pair = None;
        }
        is_within
    }
}
