//! transform_path(): cuts a path in GS_n into transfers and regrasps by halving it (Saut 2011, sec. 4.3, algorithm 2).

use crate::in_hand::attempt::search::{Search, Stop};
use crate::in_hand::moving::grasp_path::GraspPath;
use crate::in_hand::searching::visibility::link::single_sequence;
use regrasp_manipulation::grasp::sequence::Sequence;
use regrasp_manipulation::grasp::state::GraspState;

/// Halvings after which a piece counts as one that cannot be decomposed. Saut 2011 stops where the object's poses are
/// close; a path may also have equal poses at both ends (by measurement on a prototype).
const MAX_HALVINGS: u32 = 11;

/// A piece of a path: its ends, with their parameters.
struct Piece<'p> {
    path: &'p GraspPath,
    from: f64,
    to: f64,
    end: &'p GraspState,
}

/// Motions from `start` to `end`, the ends of `path`; None when a piece cannot be decomposed.
pub fn decompose(
    search: &mut Search,
    path: &GraspPath,
    start: &GraspState,
    end: &GraspState,
) -> Result<Option<Sequence>, Stop> {
    transform_path(search, start, &Piece { path, from: 0.0, to: 1.0, end }, MAX_HALVINGS)
}

/// The motions of one piece, from exactly `start` to exactly its end.
fn transform_path(
    search: &mut Search,
    start: &GraspState,
    piece: &Piece,
    halvings: u32,
) -> Result<Option<Sequence>, Stop> {
    search.check()?;
    if let Some(sequence) = single_sequence(search, start, piece.end) {
        return Ok(Some(sequence));
    }
    if halvings == 0 {
        return Ok(None);
    }
    let half = 0.5 * (piece.from + piece.to);
    let Some(middle) = piece.path.at(search.model(), half) else { return Ok(None) };
    let first = Piece { to: half, end: &middle, ..*piece };
    let Some(to_middle) = transform_path(search, start, &first, halvings - 1)? else { return Ok(None) };
    let from_middle = transform_path(search, &middle, &Piece { from: half, ..*piece }, halvings - 1)?;
    Ok(from_middle.and_then(|rest| to_middle.then(rest)))
}
