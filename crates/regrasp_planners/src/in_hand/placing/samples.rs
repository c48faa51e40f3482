//! Contacts spread over the object, and which of them close with each other: known once, wherever the object is.

use regrasp_base::Rng;
use regrasp_geometry::{Surface, UnitVector, Vector};
use regrasp_grasp::{Contact, ContactModel, Grip, closure};
use regrasp_manipulation::model::Model;

/// Contacts that are spread: as many as a word has bits.
pub const CONTACTS: usize = 64;
/// Rays cast for each.
const RAYS: usize = 30;

/// Contacts spread over the object, and the sets of them that close.
#[derive(Debug)]
pub struct ContactSamples {
    /// The contacts, at most [`CONTACTS`].
    pub contacts: Vec<Contact>,
    /// Per ordered pair, the third contacts with which it closes, as bits.
    thirds: Vec<u64>,
    /// Per contact, the second ones with which it closes where both fingertips are soft, as bits.
    seconds: Vec<u64>,
}

impl ContactSamples {
    /// Draws contacts that fingertips of the hand fit, in all directions from within the object.
    pub fn draw(model: &Model, rng: &mut Rng) -> Self {
        let object = &model.view.object;
        let settle_radius = model.fingers.iter().map(|finger| finger.settle_radius).fold(0.0, f64::max);
        let contacts = (0..CONTACTS).filter_map(|_| {
            (0..RAYS).find_map(|_| {
                let inner = object.center_of_mass
                    + Vector::from(rng.direction()) * (0.4 * model.frame.torque_scale * rng.unit());
                draw_contact(&object.surface, object.edge_distance, settle_radius, inner, rng)
            })
        });
        let contacts: Vec<Contact> = contacts.collect();
        let n = contacts.len();
        let (mut thirds, mut seconds) = (vec![0u64; n * n], vec![0u64; n]);
        let is_smooth = model.fingers.iter().all(|finger| finger.contact == ContactModel::Frictionless);
        let enough = model.settings.closure_margin;
        if !is_smooth {
            for i in 0..n {
                for j in i + 1..n {
                    for k in j + 1..n {
                        let three = [contacts[i], contacts[j], contacts[k]];
                        if closure::three::prove(&three, &model.frame).is_some_and(|(margin, _)| margin >= enough) {
                            for [a, b, c] in [[i, j, k], [i, k, j], [j, k, i]] {
                                thirds[a * n + b] |= 1 << c;
                                thirds[b * n + a] |= 1 << c;
                            }
                        }
                    }
                }
            }
        }
        let soft = model.fingers.iter().map(|finger| finger.contact);
        if let Some(soft) = soft.into_iter().find(|contact| matches!(contact, ContactModel::SoftFinger { .. })) {
            for i in 0..n {
                for j in i + 1..n {
                    let grips = [i, j].map(|which| Grip { contact: contacts[which], model: soft });
                    if closure::general::prove(&grips, &model.frame, enough).margin() >= enough {
                        seconds[i] |= 1 << j;
                        seconds[j] |= 1 << i;
                    }
                }
            }
        }
        ContactSamples { contacts, thirds, seconds }
    }

    /// The same for an object that is `factor` times as large: closure does not depend on size.
    #[must_use]
    pub fn scaled(&self, factor: f64) -> Self {
        let scaled = |contact: &Contact| Contact { point_in_object: contact.point_in_object * factor, ..*contact };
        let contacts = self.contacts.iter().map(scaled).collect();
        ContactSamples { contacts, thirds: self.thirds.clone(), seconds: self.seconds.clone() }
    }

    /// Share of the triples, one contact of each of three sets, that close.
    pub fn share_of_triples(&self, [a, b, c]: [u64; 3]) -> f64 {
        let n = self.contacts.len();
        let n_closed: u32 =
            bits(a).map(|i| bits(b).map(|j| (self.thirds[i * n + j] & c).count_ones()).sum::<u32>()).sum();
        f64::from(n_closed) / (n as f64).powi(3)
    }

    /// Share of the pairs, one contact of each of two sets, that close under soft fingertips.
    pub fn share_of_pairs(&self, [a, b]: [u64; 2]) -> f64 {
        let n_closed: u32 = bits(a).map(|i| (self.seconds[i] & b).count_ones()).sum();
        f64::from(n_closed) / (self.contacts.len() as f64).powi(2)
    }
}

fn draw_contact(
    surface: &Surface,
    edge_distance: f64,
    settle_radius: f64,
    inner: regrasp_geometry::Point,
    rng: &mut Rng,
) -> Option<Contact> {
    let direction = UnitVector::try_new(Vector::from(rng.direction()), 1e-9)?;
    let mut exits = surface.exits(&inner, &direction);
    if exits.is_empty() {
        return None;
    }
    let hit = exits.swap_remove(rng.below(exits.len()));
    let hit = surface.settle(&hit, settle_radius)?;
    (surface.crease_distance(&hit) >= edge_distance)
        .then_some(Contact { point_in_object: hit.point_in_object, normal_in_object: hit.normal_in_object })
}

/// Indices of the bits that are set.
fn bits(word: u64) -> impl Iterator<Item = usize> {
    let mut left = word;
    std::iter::from_fn(move || {
        let next = (left != 0).then(|| left.trailing_zeros() as usize)?;
        left &= left - 1;
        Some(next)
    })
}
