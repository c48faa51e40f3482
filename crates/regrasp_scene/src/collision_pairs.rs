//! Who may not touch whom around one hand: every pair that its planner has to keep apart.
//!
//! Left out: pairs that the hand allows (`Hand::may_touch`: the palm and first bodies that stand on it are among them), neighbours in a finger
//! (bodies joined by one joint), and pairs that never move against each other (palm and obstacles).

use crate::hand_view::HandView;
use regrasp_robot::{FingerId, Hand, LinkId};

/// A collision shape of a finger: `hand.fingers[finger].shapes[shape]`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct FingerShapeId {
    /// The finger.
    pub finger: FingerId,
    /// Index in `Finger::shapes`.
    pub shape: usize,
}

/// The pairs of a view, each kind in the order of fingers, shapes, palm and obstacles.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct CollisionPairs {
    /// Shapes of tip links, which may touch the object but not enter it.
    pub tip_object: Vec<FingerShapeId>,
    /// Shapes of other finger links, which may not touch the object.
    pub link_object: Vec<FingerShapeId>,
    /// Shapes of two fingers, the smaller id first.
    pub finger_finger: Vec<(FingerShapeId, FingerShapeId)>,
    /// Shapes of one finger on bodies that are no neighbours, the smaller id first.
    pub within_finger: Vec<(FingerShapeId, FingerShapeId)>,
    /// Finger shape and index in `Hand::palm`.
    pub finger_palm: Vec<(FingerShapeId, usize)>,
    /// Finger shape and index in [`HandView::obstacles`].
    pub finger_obstacle: Vec<(FingerShapeId, usize)>,
    /// Indices in `Hand::palm`: the object against each.
    pub palm_object: Vec<usize>,
    /// Indices in [`HandView::obstacles`]: the object against each.
    pub object_obstacle: Vec<usize>,
}

/// The pairs of `view`.
pub fn collision_pairs(view: &HandView) -> CollisionPairs {
    let hand = view.hand;
    let shapes = finger_shapes(hand);
    let mut pairs = CollisionPairs {
        palm_object: (0..hand.palm.len()).collect(),
        object_obstacle: (0..view.obstacles.len()).collect(),
        ..CollisionPairs::default()
    };
    for (i, &a) in shapes.iter().enumerate() {
        if shape_of(hand, a).is_tip {
            pairs.tip_object.push(a);
        } else {
            pairs.link_object.push(a);
        }
        for &b in &shapes[i + 1..] {
            if hand.may_touch(link_of(hand, a), link_of(hand, b)) {
                continue;
            }
            if a.finger != b.finger {
                pairs.finger_finger.push((a, b));
            } else if shape_of(hand, a).body.abs_diff(shape_of(hand, b).body) > 1 {
                pairs.within_finger.push((a, b));
            }
        }
        let palm = hand.palm.iter().enumerate().filter(|(_, palm)| !hand.may_touch(link_of(hand, a), palm.link));
        pairs.finger_palm.extend(palm.map(|(index, _)| (a, index)));
        pairs.finger_obstacle.extend((0..view.obstacles.len()).map(|obstacle| (a, obstacle)));
    }
    pairs
}

fn finger_shapes(hand: &Hand) -> Vec<FingerShapeId> {
    let of_finger = |(finger, n_shapes): (usize, usize)| {
        (0..n_shapes).map(move |shape| FingerShapeId { finger: FingerId(finger), shape })
    };
    hand.fingers.iter().map(|finger| finger.shapes.len()).enumerate().flat_map(of_finger).collect()
}

fn shape_of(hand: &Hand, id: FingerShapeId) -> &regrasp_robot::FingerShape {
    &hand.fingers[id.finger.0].shapes[id.shape]
}

fn link_of(hand: &Hand, id: FingerShapeId) -> LinkId {
    shape_of(hand, id).link
}
