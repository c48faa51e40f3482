//! Key frames and storyboards.

use crate::sample::{Sample, options_with_models};
use regrasp_plan::plan::SegmentKind;
use regrasp_robot::LoadOptions;
use regrasp_viewer::Story;
use regrasp_viewer::storyboard::key_frames::{Event, key_frames};
use regrasp_viewer::storyboard::{StoryboardError, StoryboardSettings, storyboard, storyboard_picture};

fn small(frames: usize) -> StoryboardSettings {
    StoryboardSettings { frames, width: 480, supersampling: 2, ..StoryboardSettings::default() }
}

fn box_story() -> Story {
    Sample::new("scenes/box_90x.toml", LoadOptions::default()).story()
}

#[test]
fn key_frames_are_start_motions_of_fingers_and_goal_in_order() {
    let story = box_story();
    let plan = story.plan.as_ref().expect("a plan");
    let regrasps = plan.segments.iter().filter(|segment| segment.kind == SegmentKind::Regrasp).count();
    for n in 2..14 {
        let frames = key_frames(&story.scene, plan, n);
        assert_eq!(frames.len(), n);
        assert_eq!(frames[0].event, Event::Start);
        assert_eq!(frames[n - 1].event, Event::Goal);
        assert!(frames.windows(2).all(|pair| pair[0].time <= pair[1].time && pair[0].step < pair[1].step));
        let moving = frames.iter().filter(|frame| frame.moving.is_some()).count();
        assert!(moving >= regrasps.min(n - 2), "{moving} of {regrasps} in {n} frames");
        for frame in frames.iter().filter(|frame| frame.moving.is_some()) {
            assert!(frame.path.len() >= 2);
            assert!(matches!(frame.event, Event::Relocates | Event::Lands | Event::LetsGo | Event::MovesFreely));
        }
    }
    let last = key_frames(&story.scene, plan, 2)[1].clone();
    assert!((last.turned.to_degrees() - 90.0).abs() < 1e-3);
}

#[test]
fn a_storyboard_is_the_same_again_and_as_wide_as_asked() {
    let story = box_story();
    let bytes = storyboard(&story, &small(4)).expect("a storyboard");
    assert!(bytes == storyboard(&story, &small(4)).expect("a storyboard"));
    let picture = storyboard_picture(&story, &small(4)).expect("a storyboard");
    assert_eq!(picture.width, 480);
    // Nothing is cut: 4 frames of 115 by 90 pixels, 4 pixels apart, are white along their borders.
    let is_white = |x: usize, y: usize| picture.rgb[3 * (480 * y + x)..][..3] == [255; 3];
    for left in [4, 123, 242, 361] {
        assert!((left..left + 115).all(|x| is_white(x, 4) && is_white(x, 93)), "cut above or below");
        assert!((4..94).all(|y| is_white(left, y) && is_white(left + 114, y)), "cut at a side");
    }
    // Each quarter shows something.
    for quarter in 0..4 {
        let columns = quarter * 120..(quarter + 1) * 120;
        let inked = (0..picture.height)
            .flat_map(|row| columns.clone().map(move |column| 3 * (row * 480 + column)))
            .filter(|&at| picture.rgb[at..at + 3] != [255; 3])
            .count();
        assert!(inked > 120 * picture.height / 10, "quarter {quarter}: {inked}");
    }
}

#[test]
fn hands_with_visual_meshes_can_be_drawn_both_ways() {
    let Some(options) = options_with_models() else { return };
    let story = Sample::new("scenes/allegro/sphere32_x.toml", options).story();
    let seen = storyboard_picture(&story, &small(2)).expect("a storyboard");
    let collision = StoryboardSettings { collision: true, ..small(2) };
    let kept_apart = storyboard_picture(&story, &collision).expect("a storyboard");
    assert_ne!(seen, kept_apart);
}

#[test]
fn any_names_can_be_written() {
    let mut story = box_story();
    let hostile = "\u{202e}<svg>\u{0}\n\u{1f590} a name that is far too long for the place that it has";
    let plan = story.plan.as_mut().expect("a plan");
    let old = plan.fingers[0].clone();
    plan.fingers[0] = hostile.into();
    for segment in &mut plan.segments {
        if segment.moving_finger.as_ref() == Some(&old) {
            segment.moving_finger = Some(hostile.into());
        }
    }
    storyboard(&story, &small(3)).expect("a storyboard");
}

#[test]
fn what_cannot_be_drawn_is_refused() {
    let story = box_story();
    for settings in [
        StoryboardSettings { frames: 1, ..small(2) },
        StoryboardSettings { frames: 1000, ..small(2) },
        StoryboardSettings { width: 3, ..small(2) },
        StoryboardSettings { width: usize::MAX, ..small(2) },
        StoryboardSettings { columns: Some(0), ..small(2) },
        StoryboardSettings { supersampling: 0, ..small(2) },
    ] {
        assert!(matches!(storyboard(&story, &settings), Err(StoryboardError::Settings(_))), "{settings:?}");
    }
    let mut other = story.clone();
    other.plan = None;
    assert!(matches!(storyboard(&other, &small(2)), Err(StoryboardError::Plan(_))));
    let mut other = story.clone();
    other.scene.hands[0].joints.pop();
    assert!(matches!(storyboard(&other, &small(2)), Err(StoryboardError::Plan(_))));
    let mut other = story;
    other.scene.meshes[0].vertices = "?".into();
    assert!(matches!(storyboard(&other, &small(2)), Err(StoryboardError::Plan(_))));
}
