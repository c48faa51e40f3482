//! Footholds gathered at one object pose. Nodes at the same pose share them, so that a pose that is looked at again is
//! looked at better.

use crate::in_hand::attempt::search::Search;
use crate::in_hand::grasps::candidate::{Candidate, Way, follow_share};
use regrasp_geometry::Pose;
use regrasp_geometry::collision::Placement;
use regrasp_grasp::Contact;
use regrasp_manipulation::grasp::contact::draw_footholds;
use regrasp_manipulation::grasp::state::GraspState;
use regrasp_robot::kinematics::finger_ik::Coordinates;

/// Most footholds kept per finger.
const POOL_SIZE: usize = 32;
/// Footholds from which on only few new ones are drawn.
const PLENTY: usize = 12;
/// Footholds drawn then. Drawing costs as much as all else; by measurement on allegro/cube57_x and cube57_180z a quarter less
/// time than with `candidates` new ones each time.
const A_FEW: usize = 2;

/// Footholds of every finger at one pose, with how far they follow to the aim.
#[derive(Debug)]
pub struct Pool {
    world_from_object: Pose,
    placement: Placement,
    way: Way,
    of_finger: Vec<Vec<Foothold>>,
}

#[derive(Debug, Clone)]
struct Foothold {
    contact: Contact,
    joints: Coordinates,
    /// Share of the way to the aim that it follows; None until that is asked for.
    follow: Option<f64>,
}

impl Foothold {
    fn candidate(&self, follow: f64) -> Candidate {
        Candidate { contact: Some(self.contact), joints: self.joints.clone(), follow }
    }

    /// As [`Foothold::follow`], with those not looked at last.
    fn rank(&self) -> f64 {
        self.follow.unwrap_or(0.0)
    }
}

/// Forgets those that were drawn first, where there are too many.
fn keep_newest(footholds: &mut Vec<Foothold>) {
    footholds.drain(..footholds.len().saturating_sub(POOL_SIZE));
}

impl Pool {
    /// An empty pool at `world_from_object`, for the way to `aim`.
    pub fn new(world_from_object: &Pose, aim: &Pose, n_fingers: usize) -> Self {
        Pool {
            world_from_object: *world_from_object,
            placement: Placement::from(world_from_object),
            way: Way::new(world_from_object, aim),
            of_finger: vec![Vec::new(); n_fingers],
        }
    }

    /// Its pose.
    pub fn world_from_object(&self) -> &Pose {
        &self.world_from_object
    }

    /// The way to the aim.
    pub fn way(&self) -> &Way {
        &self.way
    }

    fn grow(&mut self, search: &mut Search, finger: usize) {
        let footholds = &mut self.of_finger[finger];
        let n_before = footholds.len();
        let n_drawn = if n_before < PLENTY { search.settings.search.candidates } else { A_FEW };
        search.workspace.place_object(&self.world_from_object);
        draw_footholds(&mut search.workspace, finger, &self.placement, n_drawn, &mut search.rng, |contact, joints| {
            footholds.push(Foothold { contact, joints, follow: None });
        });
        search.n_samples += (footholds.len() - n_before) as u64;
    }

    /// Up to `n_wanted` candidates of `finger`, any; new ones are drawn only where there are too few.
    ///
    /// The search's workspace is left anywhere.
    pub fn any(&mut self, search: &mut Search, finger: usize, n_wanted: usize) -> Vec<Candidate> {
        if self.of_finger[finger].len() < n_wanted {
            self.grow(search, finger);
        }
        let footholds = &self.of_finger[finger];
        let mut order: Vec<usize> = (0..footholds.len()).collect();
        search.rng.shuffle(&mut order);
        order.truncate(n_wanted);
        order.into_iter().map(|which| footholds[which].candidate(footholds[which].rank())).collect()
    }

    /// For every finger what it does in `state`, which is at the pool's pose, then up to `n_wanted` candidates, any.
    ///
    /// The search's workspace is left anywhere.
    pub fn around(&mut self, search: &mut Search, state: &GraspState, n_wanted: usize) -> Vec<Vec<Candidate>> {
        let of_finger = |finger| {
            let mut of_finger = vec![Candidate::present(state, finger)];
            of_finger.extend(self.any(search, finger, n_wanted));
            of_finger
        };
        (0..state.joints.len()).map(of_finger).collect()
    }

    /// Up to `n_wanted` candidates of `finger` for the way to the aim: those that follow farthest, and one of the others
    /// for variety. Empty when none was ever found.
    ///
    /// The search's workspace is left with the object at the pool's pose.
    pub fn towards_aim(&mut self, search: &mut Search, finger: usize, n_wanted: usize) -> Vec<Candidate> {
        self.grow(search, finger);
        let footholds = &mut self.of_finger[finger];
        for new in footholds.iter_mut().filter(|foothold| foothold.follow.is_none()) {
            let share = follow_share(&mut search.workspace, finger, &new.contact, &new.joints, &self.way);
            new.follow = Some(share);
        }
        search.workspace.place_object(&self.world_from_object);
        if self.way.stays() {
            // All follow as far: the newest are kept, or no other would ever be tried.
            keep_newest(footholds);
        }
        footholds.sort_by(|a, b| b.rank().total_cmp(&a.rank()));
        footholds.truncate(POOL_SIZE);
        let mut order: Vec<usize> = (0..footholds.len()).collect();
        search.rng.shuffle(&mut order);
        // Stable: those that follow equally far stay in random order.
        order.sort_by(|&a, &b| footholds[b].rank().total_cmp(&footholds[a].rank()));
        if order.len() > n_wanted && n_wanted > 1 {
            let other = n_wanted - 1 + search.rng.below(order.len() - n_wanted + 1);
            order.swap(n_wanted - 1, other);
        }
        order.truncate(n_wanted);
        order.into_iter().map(|which| footholds[which].candidate(footholds[which].rank())).collect()
    }

    /// Of some candidates of `finger`, the up to `n_wanted` that follow another way farthest.
    ///
    /// The search's workspace is left with the object at the pool's pose.
    pub fn along(&mut self, search: &mut Search, finger: usize, way: &Way, n_wanted: usize) -> Vec<Candidate> {
        self.grow(search, finger);
        let footholds = &mut self.of_finger[finger];
        let mut order: Vec<usize> = (0..footholds.len()).collect();
        search.rng.shuffle(&mut order);
        order.truncate(search.settings.search.candidates);
        let mut found = Vec::with_capacity(order.len());
        for which in order {
            let Foothold { contact, joints, .. } = &footholds[which];
            let follow = follow_share(&mut search.workspace, finger, contact, joints, way);
            found.push(footholds[which].candidate(follow));
        }
        search.workspace.place_object(&self.world_from_object);
        keep_newest(footholds);
        // Stable: equal shares stay in random order.
        found.sort_by(|a: &Candidate, b| b.follow.total_cmp(&a.follow));
        found.truncate(n_wanted);
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::in_hand::roadmap_tests::with_settings;
    use crate::settings::InHandSettings;

    #[test]
    fn where_the_object_stays_new_contacts_are_tried_on_and_on() {
        with_settings("sphere_90x.toml", &InHandSettings::default(), |search| {
            let start = search.start;
            let mut pool = Pool::new(&start, &start, search.model().n_fingers());
            let mut seen: Vec<Contact> = Vec::new();
            let mut n_new = [0; 2];
            for round in 0..400 {
                for candidate in pool.towards_aim(search, 0, 4) {
                    let contact = candidate.contact.expect("it touches");
                    if !seen.contains(&contact) {
                        seen.push(contact);
                        n_new[round / 200] += 1;
                    }
                }
                assert!(pool.of_finger[0].len() <= POOL_SIZE);
            }
            // Of 32 that stay for ever there is nothing new in the second half.
            assert!(n_new[0] > 2 * POOL_SIZE && n_new[1] > 2 * POOL_SIZE, "{n_new:?}");
        });
    }
}
