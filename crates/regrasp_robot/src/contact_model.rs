//! What a fingertip can transmit where it touches.

use regrasp_base::toml_table::{Found, Table};

/// Torsion radii above this are mistakes of units: no fingertip has a patch of contact that large. Metres.
pub const MAX_TORSION_RADIUS: f64 = 0.05;

/// Contact model of a fingertip. Normal force `f_n >= 0`, tangential force `f_t`, moment about the contact normal `m`.
///
/// Mason, Salisbury, *Robot Hands and the Mechanics of Manipulation*, 1985, table of contact types; the friction
/// coefficient `mu` belongs to the pair of fingertip and object and stands in the scene.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum ContactModel {
    /// Frictionless point: `f_t = 0`, `m = 0`.
    Frictionless,
    /// Point with friction: `|f_t| <= mu f_n`, `m = 0`.
    #[default]
    Point,
    /// Soft finger, elliptic approximation: `|f_t|^2 + (m / torsion_radius)^2 <= (mu f_n)^2` (Howe, Cutkosky, *Practical
    /// force-motion models for sliding manipulation*, IJRR 15 (1996)).
    SoftFinger {
        /// Largest moment about the normal over largest tangential force, in metres, above 0: the torsional friction
        /// coefficient is `mu * torsion_radius`. For a round patch of radius `a` it is `2/3 a` under even pressure and
        /// `3 pi / 16 a` under Hertz's.
        torsion_radius: f64,
    },
}

impl ContactModel {
    /// Names in files, in the order of the variants.
    pub const NAMES: [&str; 3] = ["frictionless", "point", "soft_finger"];

    /// Name in files.
    pub fn name(&self) -> &'static str {
        match self {
            ContactModel::Frictionless => Self::NAMES[0],
            ContactModel::Point => Self::NAMES[1],
            ContactModel::SoftFinger { .. } => Self::NAMES[2],
        }
    }
}

/// The model in `key` (`"contact"` or `"model"`) and `torsion_radius` of `table`; `default` where neither is there.
///
/// Errors: an unknown word, a radius out of range, and with `code` a radius that is missing or stands where it means
/// nothing.
pub fn read(
    table: &mut Table,
    key: &'static str,
    default: ContactModel,
    code: &'static str,
    found: &mut Found,
) -> Option<ContactModel> {
    let (name, radius) = (table.optional(key), table.optional("torsion_radius"));
    let Some(name) = name else {
        let Some(radius) = radius else { return Some(default) };
        let diagnostic =
            radius.error(code, found, "stands without a contact model").fix(format!("add {key} = \"soft_finger\""));
        found.diagnostics.push(diagnostic);
        return None;
    };
    let word = name.choice(found, &ContactModel::NAMES)?;
    let is_soft = word == ContactModel::NAMES[2];
    match radius {
        Some(radius) if !is_soft => {
            let diagnostic = radius.error(code, found, format!("stands beside \"{word}\", which has no torsion"));
            found.diagnostics.push(diagnostic.expected("a torsion radius beside \"soft_finger\" only"));
            None
        }
        None if is_soft => {
            let diagnostic = name.error(code, found, "has no `torsion_radius` beside it");
            found.diagnostics.push(diagnostic.fix("add torsion_radius = 0.005, in metres"));
            None
        }
        None if word == ContactModel::NAMES[0] => Some(ContactModel::Frictionless),
        None => Some(ContactModel::Point),
        Some(radius) => {
            let expected = format!("a length above 0 and at most {MAX_TORSION_RADIUS}, in metres");
            let torsion_radius = radius.number_that(found, &expected, |x| x > 0.0 && x <= MAX_TORSION_RADIUS)?;
            Some(ContactModel::SoftFinger { torsion_radius })
        }
    }
}
