//! Names of fingers: from what joints and links are called, else from where the fingers stand.

use super::rigid::rigid_links;
use crate::robot::{JointId, JointKind, LinkId, Robot};
use regrasp_geometry::{Point, Pose, Vector};
use std::collections::BTreeSet;

/// Words for fingers, and the fingers that they name.
const WORDS: [(&str, &str); 8] = [
    ("thumb", "thumb"),
    ("index", "index"),
    ("forefinger", "index"),
    ("middle", "middle"),
    ("ring", "ring"),
    ("little", "little"),
    ("pinky", "little"),
    ("pinkie", "little"),
];
/// Prefixes for fingers: those of the Shadow hand, where every link and joint of a finger has its own.
const PREFIXES: [(&str, &str); 5] =
    [("ff", "index"), ("mf", "middle"), ("rf", "ring"), ("lf", "little"), ("th", "thumb")];
/// Fingers beside the thumb, from its side.
const FROM_THUMB: [&str; 4] = ["index", "middle", "ring", "little"];
/// Fingers bend about the same axis where its directions differ by less than this cosine says (25 degrees).
const SAME_AXIS: f64 = 0.9;
/// The thumb stands nearer to one end of the row of fingers by at least this share of its length.
const ASIDE: f64 = 0.1;

/// A finger by its last moving joint and its tip link.
#[derive(Debug, Clone, Copy)]
pub(super) struct End {
    pub last: JointId,
    pub tip: LinkId,
}

/// Names of the fingers that end at `ends`, each once.
pub(super) fn finger_names(robot: &Robot, base: LinkId, ends: &[End]) -> Vec<String> {
    let called: Vec<Vec<String>> = ends.iter().map(|end| names_along(robot, base, end)).collect();
    let mut names: Vec<Option<String>> = by_prefix(&called).unwrap_or_else(|| by_word(&called));
    let is_alone = |names: &[Option<String>], name: &str| !names.iter().flatten().any(|other| other == name);
    for (k, standing) in by_place(robot, base, ends, &names).into_iter().enumerate() {
        if names[k].is_none()
            && let Some(standing) = standing.filter(|name| is_alone(&names, name))
        {
            names[k] = Some(standing);
        }
    }
    for (k, part) in by_own_part(&called).into_iter().enumerate() {
        if names[k].is_none()
            && let Some(part) = part.filter(|part| is_alone(&names, part))
        {
            names[k] = Some(part);
        }
    }
    for k in 0..names.len() {
        if names[k].is_none() {
            // Another finger may have that number as its own part.
            names[k] = (k + 1..).map(|number| format!("finger_{number}")).find(|name| is_alone(&names, name));
        }
    }
    names.into_iter().flatten().collect()
}

/// What moving joints, their links and the links at the tip are called, in small letters.
fn names_along(robot: &Robot, base: LinkId, end: &End) -> Vec<String> {
    let above = robot.joints_to(base).len();
    let path = robot.joints_to(end.tip).into_iter().skip(above);
    let moving: Vec<JointId> = path.filter(|id| robot.joints[id.0].kind != JointKind::Fixed).collect();
    let joints = moving.iter().map(|id| robot.joints[id.0].name.as_str());
    let links = moving.iter().map(|id| robot.links[robot.joints[id.0].child.0].name.as_str());
    let below = rigid_links(robot, robot.joints[end.last.0].child).into_iter();
    let below = below.map(|(link, _)| robot.links[link.0].name.as_str());
    joints.chain(links).chain(below).map(str::to_lowercase).collect()
}

/// Names by prefixes, where all names of every finger begin with one.
fn by_prefix(called: &[Vec<String>]) -> Option<Vec<Option<String>>> {
    let of_finger = |names: &Vec<String>| {
        let has = |prefix: &str| names.iter().all(|name| name.starts_with(prefix));
        PREFIXES.iter().find(|(prefix, _)| has(prefix)).map(|(_, name)| Some((*name).to_owned()))
    };
    let found: Option<Vec<Option<String>>> = called.iter().map(of_finger).collect();
    found.filter(|names| names.iter().collect::<BTreeSet<_>>().len() == names.len())
}

/// Names by words that are in the names of one finger and of no other.
fn by_word(called: &[Vec<String>]) -> Vec<Option<String>> {
    let has = |finger: usize, word: &str| called[finger].iter().any(|name| name.contains(word));
    let of_finger = |finger: usize| {
        let is_own =
            |word: &str| has(finger, word) && (0..called.len()).all(|other| other == finger || !has(other, word));
        let mut words = WORDS.iter().filter(|(word, _)| is_own(word)).map(|(_, name)| *name);
        let first = words.next()?;
        words.all(|other| other == first).then(|| first.to_owned())
    };
    (0..called.len()).map(of_finger).collect()
}

/// Names by the part that all names of a finger have and those of no other finger: `f1`, or `finger_120` where it is a number.
fn by_own_part(called: &[Vec<String>]) -> Vec<Option<String>> {
    let parts = |name: &str| -> BTreeSet<String> {
        name.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty()).map(str::to_owned).collect()
    };
    let common: Vec<BTreeSet<String>> = called
        .iter()
        .map(|names| {
            let mut all = names.iter().map(|name| parts(name));
            let first = all.next().unwrap_or_default();
            all.fold(first, |common, next| common.intersection(&next).cloned().collect())
        })
        .collect();
    let of_finger = |finger: usize| {
        let others = |part: &&String| !common.iter().enumerate().any(|(k, other)| k != finger && other.contains(*part));
        let part = common[finger].iter().find(others)?;
        let is_number = part.chars().all(|c| c.is_ascii_digit());
        Some(if is_number { format!("finger_{part}") } else { part.clone() })
    };
    (0..called.len()).map(of_finger).collect()
}

/// Names by where fingers stand: three or four that bend about one axis stand in a row, and one beside them is the thumb; the finger at
/// its end of the row is the index finger.
fn by_place(robot: &Robot, base: LinkId, ends: &[End], known: &[Option<String>]) -> Vec<Option<String>> {
    let none = vec![None; ends.len()];
    if !(4..=5).contains(&ends.len()) {
        return none;
    }
    let stands: Vec<(Point, Vector)> = ends.iter().map(|end| stand(robot, base, end)).collect();
    let bends_with = |a: usize, b: usize| stands[a].1.dot(&stands[b].1).abs() > SAME_AXIS;
    let is_alone = |&f: &usize| (0..ends.len()).all(|other| other == f || !bends_with(f, other));
    let named = known.iter().position(|name| name.as_deref() == Some("thumb"));
    let mut alone = (0..ends.len()).filter(is_alone);
    let thumb = match (named, alone.next(), alone.next()) {
        (Some(thumb), _, _) => thumb,
        (None, Some(thumb), None) => thumb,
        _ => return none,
    };
    let mut row: Vec<usize> = (0..ends.len()).filter(|f| *f != thumb).collect();
    if !row.iter().all(|&a| row.iter().all(|&b| bends_with(a, b))) {
        return none;
    }
    // Fingers in a row stand side by side along the axis that they bend about.
    let along = stands[row[0]].1;
    let at = |f: usize| along.dot(&stands[f].0.coords);
    row.sort_by(|&a, &b| at(a).total_cmp(&at(b)));
    let (first, last) = (at(row[0]), at(row[row.len() - 1]));
    let aside = at(thumb) - 0.5 * (first + last);
    if !(aside.abs() > ASIDE * (last - first)) {
        return none;
    }
    if aside > 0.0 {
        row.reverse();
    }
    let mut names = none;
    names[thumb] = Some("thumb".into());
    row.into_iter().zip(FROM_THUMB).for_each(|(f, name)| names[f] = Some(name.into()));
    names
}

/// Where a finger begins, and the axis of its last joint, with all joints at zero; in the frame of the base.
fn stand(robot: &Robot, base: LinkId, end: &End) -> (Point, Vector) {
    let above = robot.joints_to(base).len();
    let mut pose = Pose::identity();
    let (mut first, mut axis) = (None, Vector::zeros());
    for id in robot.joints_to(end.tip).into_iter().skip(above) {
        let joint = &robot.joints[id.0];
        pose *= joint.parent_from_joint;
        if joint.kind != JointKind::Fixed {
            first.get_or_insert(pose.translation.vector);
            axis = pose * joint.axis.into_inner();
        }
    }
    (Point::from(first.unwrap_or_default()), axis)
}

#[cfg(test)]
mod tests {
    use crate::import::{LoadOptions, load_hand};
    use crate::places::shared_models;

    fn names(file: &str) -> Option<Vec<String>> {
        let path = shared_models()?.join("hands").join(file);
        let hand = load_hand(&path, &LoadOptions::default()).unwrap_or_else(|error| panic!("{file}: {error}")).hand;
        Some(hand.fingers.into_iter().map(|finger| finger.name).collect())
    }

    #[test]
    fn fingers_are_called_what_people_call_them_left_and_right_alike() {
        let four = ["index", "middle", "ring", "thumb"].as_slice();
        let five = ["index", "middle", "ring", "little", "thumb"].as_slice();
        for (file, expected) in [
            ("allegro/allegro_right.urdf", four),
            // The left hand's file begins at the other end of the row.
            ("allegro/allegro_left.urdf", &["ring", "middle", "index", "thumb"]),
            ("leap/leap_right.urdf", four),
            ("leap/leap_left.urdf", four),
            ("shadow/shadow_right.urdf", five),
            ("shadow/shadow_left.urdf", five),
            ("dclaw/dclaw.urdf", &["f1", "f2", "f3"]),
            ("barrett/barrett.urdf", &["finger_1", "finger_2", "finger_3"]),
            ("trifingerpro/trifingerpro.urdf", &["finger_0", "finger_120", "finger_240"]),
        ] {
            let Some(names) = names(file) else { return };
            assert_eq!(names, expected, "{file}");
        }
    }
}
