//! Settings from several places made one: defaults, then a text of settings, then single arguments. Command line and Python both
//! ask here.

use regrasp_planners::{InHandSettings, MotionSettings, PlannerSettings, TaskSettings, TrackingSettings};
use regrasp_scene::motion::MOTION;
use regrasp_scene::pick_and_place::PICK_AND_PLACE;
use regrasp_scene::query::TRACKING;
use serde::de::DeserializeOwned;

/// Arguments that win over a text of settings.
#[derive(Debug, Clone, Default)]
pub struct Overrides {
    /// Name of a method.
    pub method: Option<String>,
    /// Closure margin.
    pub margin: Option<f64>,
    /// True where the caller limits improvement by time: the work is without limit then, unless it is given.
    pub improves_for_a_time: bool,
    /// Work of improvement.
    pub improve_work: Option<u64>,
    /// Threads of in-hand planning; at least 1.
    pub n_threads: usize,
}

/// Why a text of settings and arguments make no settings.
#[derive(Debug, Clone, PartialEq)]
pub enum SettingsError {
    /// The text is not what settings look like.
    Unreadable {
        /// What is wrong with it.
        problem: String,
        /// Line, from 1.
        line: usize,
        /// Column, from 1.
        column: usize,
    },
    /// The method is not one for tasks of this kind.
    OtherMethod {
        /// The name asked for.
        name: String,
        /// What the names are.
        problem: String,
    },
    /// An argument that says nothing about tracking.
    NotForTracking {
        /// Which argument.
        argument: Argument,
        /// Why not.
        why: &'static str,
    },
    /// A value makes no sense.
    Invalid(String),
}

/// Arguments of in-hand tasks only.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Argument {
    /// Closure margin.
    Margin,
    /// Time of improvement.
    Improve,
    /// Work of improvement.
    ImproveWork,
}

/// The settings for a task of the kind called `kind`; those of the other kind are the defaults.
///
/// Errors: as [`SettingsError`].
pub fn settings_for(kind: &str, text: Option<&str>, asked: &Overrides) -> Result<PlannerSettings, SettingsError> {
    let defaults = PlannerSettings::default();
    if kind == TRACKING {
        return Ok(PlannerSettings { tracking: tracking(text, asked)?, ..defaults });
    }
    if kind == MOTION {
        return Ok(PlannerSettings { motion: motion(text, asked)?, ..defaults });
    }
    if kind == PICK_AND_PLACE {
        // Lists that the scene does not name are made on as many threads as planning in the hand has.
        let in_hand = InHandSettings { n_threads: asked.n_threads.max(1), ..InHandSettings::default() };
        return Ok(PlannerSettings { task: task(text, asked)?, in_hand, ..defaults });
    }
    Ok(PlannerSettings { in_hand: in_hand(text, asked)?, ..defaults })
}

fn task(text: Option<&str>, asked: &Overrides) -> Result<TaskSettings, SettingsError> {
    if let Some(name) = &asked.method {
        let problem = "tasks of pick and place have one method".to_owned();
        return Err(SettingsError::OtherMethod { name: name.clone(), problem });
    }
    let settings: TaskSettings = read(text)?;
    settings.validate().map_err(SettingsError::Invalid)?;
    Ok(settings)
}

fn in_hand(text: Option<&str>, asked: &Overrides) -> Result<InHandSettings, SettingsError> {
    let mut settings: InHandSettings = read(text)?;
    settings.n_threads = asked.n_threads;
    if let Some(name) = &asked.method {
        settings.method = method_named(name)?;
    }
    if let Some(margin) = asked.margin {
        settings.physics.closure_margin = margin;
    }
    let improvement = &mut settings.improvement;
    match asked.improve_work {
        Some(work) => improvement.improve_work = work,
        // Time alone is to end it.
        None if asked.improves_for_a_time && improvement.improve_work == 0 => improvement.improve_work = u64::MAX,
        None => {}
    }
    settings.validate().map_err(SettingsError::Invalid)?;
    Ok(settings)
}

fn tracking(text: Option<&str>, asked: &Overrides) -> Result<TrackingSettings, SettingsError> {
    let arguments = [
        (Argument::Margin, asked.margin.is_some(), "force closure is not defined for sliding contacts"),
        (Argument::Improve, asked.improves_for_a_time, "plans of tracking are not improved"),
        (Argument::ImproveWork, asked.improve_work.is_some(), "plans of tracking are not improved"),
    ];
    if let Some((argument, _, why)) = arguments.into_iter().find(|(_, is_given, _)| *is_given) {
        return Err(SettingsError::NotForTracking { argument, why });
    }
    let mut settings: TrackingSettings = read(text)?;
    if let Some(name) = &asked.method {
        settings.method = method_named(name)?;
    }
    settings.validate().map_err(SettingsError::Invalid)?;
    Ok(settings)
}

fn motion(text: Option<&str>, asked: &Overrides) -> Result<MotionSettings, SettingsError> {
    let mut settings: MotionSettings = read(text)?;
    if let Some(name) = &asked.method {
        settings.method = method_named(name)?;
    }
    settings.validate().map_err(SettingsError::Invalid)?;
    Ok(settings)
}

/// Settings as a text of JSON has them; keys that it lacks are the defaults.
///
/// Errors: [`SettingsError::Unreadable`].
pub fn read<T: Default + DeserializeOwned>(text: Option<&str>) -> Result<T, SettingsError> {
    let Some(text) = text else { return Ok(T::default()) };
    // serde would take a list for the fields in their order, and an empty one for the defaults.
    if text.trim_start().starts_with('[') {
        return Err(SettingsError::Unreadable { problem: "is a list".into(), line: 1, column: 1 });
    }
    serde_json::from_str(text).map_err(|error| {
        let message = error.to_string();
        // serde_json repeats the place at the end of its message.
        let problem = message.rsplit_once(" at line ").map_or(message.as_str(), |(problem, _)| problem).to_owned();
        SettingsError::Unreadable { problem, line: error.line(), column: error.column().max(1) }
    })
}

fn method_named<T: DeserializeOwned>(name: &str) -> Result<T, SettingsError> {
    serde_json::from_value(name.into())
        .map_err(|error| SettingsError::OtherMethod { name: name.to_owned(), problem: error.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use regrasp_planners::{Method, TrackingMethod};
    use regrasp_scene::query::IN_HAND;

    fn one_thread() -> Overrides {
        Overrides { n_threads: 1, ..Overrides::default() }
    }

    #[test]
    fn arguments_win_over_the_text_and_the_text_over_defaults() {
        let text = r#"{"method": "classic", "closure_margin": 0.01, "step": 0.002, "improve_work": 5}"#;
        let asked = Overrides { method: Some("visibility".into()), margin: Some(0.03), n_threads: 4, ..one_thread() };
        let settings = settings_for(IN_HAND, Some(text), &asked).unwrap().in_hand;
        assert_eq!((settings.method, settings.n_threads), (Method::Visibility, 4));
        assert_eq!((settings.physics.closure_margin, settings.physics.step), (0.03, 0.002));
        let for_a_time = Overrides { improves_for_a_time: true, ..one_thread() };
        let work =
            |text, asked: &Overrides| settings_for(IN_HAND, text, asked).unwrap().in_hand.improvement.improve_work;
        assert_eq!((work(Some(text), &for_a_time), work(None, &for_a_time)), (5, u64::MAX));
        assert_eq!(work(Some(text), &Overrides { improve_work: Some(9), ..for_a_time }), 9);
        let gaits = Overrides { method: Some("tracking+gaiting".into()), ..one_thread() };
        let settings = settings_for(TRACKING, Some(r#"{"trials": 7}"#), &gaits).unwrap();
        assert_eq!((settings.tracking.method, settings.tracking.trials), (TrackingMethod::TrackingAndGaiting, 7));
        assert_eq!(settings.in_hand, InHandSettings::default());
    }

    #[test]
    fn what_makes_no_settings_is_told() {
        let margin = Overrides { margin: Some(0.01), ..one_thread() };
        let of_tracking = Overrides { method: Some("tracking".into()), ..one_thread() };
        assert!(matches!(
            settings_for(TRACKING, None, &margin),
            Err(SettingsError::NotForTracking { argument: Argument::Margin, .. })
        ));
        assert!(matches!(settings_for(IN_HAND, None, &of_tracking), Err(SettingsError::OtherMethod { .. })));
        for (text, line) in [("[]", 1), ("{\n \"closure_margn\": 1}", 2), ("", 1)] {
            let Err(SettingsError::Unreadable { line: found, .. }) = settings_for(IN_HAND, Some(text), &one_thread())
            else {
                panic!("{text} was read");
            };
            assert_eq!(found, line, "{text}");
        }
        let none = Overrides::default();
        assert!(matches!(settings_for(IN_HAND, None, &none), Err(SettingsError::Invalid(_))));
    }
}
