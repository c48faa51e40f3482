//! `package://` and relative paths of model files, below allowed folders.
//!
//! Order for `package://NAME/REST`: the packages given by name; the search paths (`DIR/NAME`, `DIR` itself when it is
//! called NAME, `DIR/share/NAME`); the folder above the model whose `package.xml` has that name; a folder of that name
//! beside the model or one of the folders above it. Nothing is executed and nothing is fetched.

use regrasp_base::diagnostic::did_you_mean;
use regrasp_base::{Diagnostic, Place};
use std::ffi::OsStr;
use std::fs;
use std::path::{Component, Path, PathBuf};

/// How many folders above the model are looked at.
const MAX_WALK_UP: usize = 5;
/// How many directory entries the search for a file of the same name looks at.
const MAX_ENTRIES_FOR_HINT: usize = 2_000;
/// Folder names that hold models inside a package, whose parent then belongs to the model.
const MODEL_FOLDERS: [&str; 3] = ["urdf", "robots", "robot"];

/// Where packages are.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ResolveOptions {
    /// Packages given by name and folder; looked at first, and allowed as roots of every path.
    pub packages: Vec<(String, PathBuf)>,
    /// Folders such as the entries of `ROS_PACKAGE_PATH` and `AMENT_PREFIX_PATH`, in order.
    pub search_paths: Vec<PathBuf>,
}

/// A file found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Resolved {
    /// The file.
    pub path: PathBuf,
    /// Remarks: another case of letters, a folder that stood in for a package.
    pub notes: Vec<String>,
}

/// The file that `name`, found in the model file `model`, means.
///
/// Errors (without element): `U101` not found, with every path tried; `U102` no file name; `U103` refused because it is
/// fetched, absolute or leaves the allowed folders.
pub fn resolve(name: &str, model: &Path, place: Place, options: &ResolveOptions) -> Result<Resolved, Diagnostic> {
    resolve_with(name, model, place, options, Hints::SameNameNear)
}

/// What a message about a missing file says besides where it was looked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Hints {
    /// Nothing.
    None,
    /// Where a file of the same name is: some thousand folder entries are looked at.
    SameNameNear,
}

/// As [`resolve`], with the hints asked for.
pub(crate) fn resolve_with(
    name: &str,
    model: &Path,
    place: Place,
    options: &ResolveOptions,
    hints: Hints,
) -> Result<Resolved, Diagnostic> {
    let search = Search { folder: folder_of(model), options, hints };
    if name.trim().is_empty() {
        return Err(Diagnostic::new("U102", place, "the file name is empty").expected("a path or package://NAME/PATH"));
    }
    if let Some(rest) = name.strip_prefix("package://").or_else(|| name.strip_prefix("model://")) {
        return in_package(name, rest, place, &search);
    }
    if let Some((scheme, path)) = name.split_once("://") {
        if scheme != "file" {
            return Err(Diagnostic::new(
                "U103",
                place,
                format!("\"{name}\" would have to be fetched; models are never fetched"),
            )
            .expected("a file")
            .fix("download it and name the file"));
        }
        return within(name, Path::new(path), &[], place, &search);
    }
    within(name, &search.folder.join(name), &[], place, &search)
}

/// Where files are looked for.
struct Search<'a> {
    /// The folder of the model.
    folder: PathBuf,
    options: &'a ResolveOptions,
    hints: Hints,
}

impl Search<'_> {
    /// A file with the same last name below `folder`, where hints are asked for.
    fn same_name(&self, folder: &Path, wanted: &Path) -> Option<PathBuf> {
        if self.hints == Hints::None { None } else { same_name_below(folder, wanted) }
    }

    /// The path of the file in the folder of `root`/`inside` whose name is nearest to that of `inside`, below `root`.
    fn similar(&self, root: &Path, inside: &Path) -> Option<PathBuf> {
        let is_below = inside.components().all(|component| matches!(component, Component::Normal(_)));
        if self.hints == Hints::None || !is_below {
            return None;
        }
        let listed = fs::read_dir(root.join(inside).parent()?).ok()?.take(MAX_ENTRIES_FOR_HINT);
        let names: Vec<String> = listed.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
        let meant = did_you_mean(inside.file_name()?.to_str()?, names.iter().map(String::as_str))?;
        Some(inside.with_file_name(meant))
    }
}

/// The file that the user's own file `file` names: as [`resolve`], but any local path is allowed.
///
/// Errors: as [`resolve`], without refusals of places outside the folders.
pub fn resolve_own(name: &str, file: &Path, place: Place, options: &ResolveOptions) -> Result<Resolved, Diagnostic> {
    let folder = folder_of(file);
    if name.trim().is_empty() || name.contains("://") {
        return resolve(name, file, place, options);
    }
    match existing(&folder.join(name)) {
        Some((path, notes)) => Ok(Resolved { path, notes }),
        None => resolve(name, file, place, options),
    }
}

/// The folder that holds `model`.
fn folder_of(model: &Path) -> PathBuf {
    match model.parent() {
        Some(parent) if parent != Path::new("") => parent.to_owned(),
        _ => PathBuf::from("."),
    }
}

fn in_package(name: &str, rest: &str, place: Place, search: &Search) -> Result<Resolved, Diagnostic> {
    let (package, inside) = match rest.split_once('/') {
        Some((package, inside)) if !package.is_empty() && !inside.trim_matches('/').is_empty() => (package, inside),
        _ => {
            return Err(Diagnostic::new("U102", place, format!("\"{name}\" has no path after the package name"))
                .expected("package://NAME/PATH"));
        }
    };
    let inside = Path::new(inside.trim_start_matches('/'));
    let mut tried = Vec::new();
    let roots = package_roots(package, &search.folder, search.options, &mut tried);
    for (source, root) in &roots {
        let (path, mut notes) = match existing(&root.join(inside)) {
            Some(found) => found,
            None => {
                tried.push(format!("{source}: {} (no such file)", root.join(inside).display()));
                continue;
            }
        };
        if *source == Source::FolderOfThatName {
            notes.push(format!("package \"{package}\" has no package.xml; the folder {} is taken", root.display()));
        }
        let resolved = within(name, &path, std::slice::from_ref(root), place, search)?;
        return Ok(Resolved { path: resolved.path, notes });
    }
    let numbered: Vec<String> = tried.iter().enumerate().map(|(i, text)| format!("({}) {text}", i + 1)).collect();
    let folder = roots.first().map_or(search.folder.as_path(), |(_, root)| root.as_path());
    let hint = search
        .same_name(folder, inside)
        .map_or(String::new(), |p| format!(" (a file of that name is at {})", p.display()));
    let fix = match roots.first() {
        None => format!("--package {package}=DIR"),
        Some((_, root)) => {
            let meant = search
                .similar(root, inside)
                .map_or(String::new(), |meant| format!(": did you mean \"package://{package}/{}\"?", meant.display()));
            format!("correct the path after the package, which is {}{meant}", root.display())
        }
    };
    Err(Diagnostic::new("U101", place, format!("\"{name}\" not found; looked in: {}", numbered.join(" ")))
        .fix(format!("{fix}{hint}")))
}

/// Where a candidate for a package comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Source {
    Given,
    SearchPath,
    PackageXml,
    FolderOfThatName,
}

impl std::fmt::Display for Source {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Source::Given => "--package",
            Source::SearchPath => "package search path",
            Source::PackageXml => "package.xml above the model",
            Source::FolderOfThatName => "folder of that name",
        })
    }
}

/// Folders that may be package `package`, in the order of the module's documentation; what is absent goes to `tried`.
fn package_roots(
    package: &str,
    folder: &Path,
    options: &ResolveOptions,
    tried: &mut Vec<String>,
) -> Vec<(Source, PathBuf)> {
    if package.contains('\\') || !matches!(Path::new(package).components().next(), Some(Component::Normal(_))) {
        tried.push(format!("\"{package}\" is not a folder name"));
        return Vec::new();
    }
    let mut roots = Vec::new();
    let given: Vec<_> = options.packages.iter().filter(|(name, _)| name == package).collect();
    if given.is_empty() {
        tried.push(format!("--package {package}: not given"));
    }
    for (_, root) in given {
        if root.is_dir() {
            roots.push((Source::Given, root.clone()));
        } else {
            tried.push(format!("--package {package}: {} (no such folder)", root.display()));
        }
    }
    if options.search_paths.is_empty() {
        tried.push("ROS_PACKAGE_PATH, AMENT_PREFIX_PATH: not set".into());
    }
    for base in &options.search_paths {
        let own = (base.file_name() == Some(OsStr::new(package))).then(|| base.clone());
        let candidates = own.into_iter().chain([base.join(package), base.join("share").join(package)]);
        let before = roots.len();
        roots.extend(candidates.filter(|dir| dir.is_dir()).map(|dir| (Source::SearchPath, dir)));
        if roots.len() == before {
            tried.push(format!("package search path: {} (no folder {package})", base.display()));
        }
    }
    let above = folders_above(folder);
    let named = above.iter().find(|dir| package_name(dir).as_deref() == Some(package));
    match named {
        Some(dir) => roots.push((Source::PackageXml, dir.clone())),
        None => tried.push(format!("package.xml above the model: none says <name>{package}</name>")),
    }
    let before = roots.len();
    for dir in &above {
        let own = (dir.file_name() == Some(OsStr::new(package))).then(|| dir.clone());
        let below = Some(dir.join(package)).filter(|below| below.is_dir());
        for root in own.into_iter().chain(below) {
            if roots[before..].iter().all(|(_, known)| *known != root) {
                roots.push((Source::FolderOfThatName, root));
            }
        }
    }
    if roots.len() == before {
        tried.push(format!("folder of that name: {} and folders above (none called {package})", folder.display()));
    }
    roots
}

/// `folder` and at most [`MAX_WALK_UP`] folders above it, as absolute paths where the folder exists; never the root of
/// the file system, beside whose folders every name would be a package.
fn folders_above(folder: &Path) -> Vec<PathBuf> {
    let absolute = fs::canonicalize(folder).unwrap_or_else(|_| folder.to_owned());
    absolute.ancestors().take(MAX_WALK_UP + 1).filter(|dir| dir.parent().is_some()).map(Path::to_owned).collect()
}

/// The name in `dir/package.xml`.
fn package_name(dir: &Path) -> Option<String> {
    let path = dir.join("package.xml");
    if !path.is_file() {
        return None;
    }
    let text = regrasp_base::files::read_text(&path).ok()?;
    let document = super::xml::parse(&path, &text).ok()?;
    let name = super::xml::child(document.root_element(), "name")?.text()?.trim().to_owned();
    Some(name)
}

/// `path` when its canonical form is a file below an allowed folder.
fn within(
    name: &str,
    path: &Path,
    more_roots: &[PathBuf],
    place: Place,
    search: &Search,
) -> Result<Resolved, Diagnostic> {
    let Some((path, notes)) = existing(path) else {
        let hint = search
            .same_name(&search.folder, Path::new(name))
            .map_or(String::new(), |found| format!("a file of that name is at {}", found.display()));
        let problem = if path.is_dir() { "is a folder" } else { "not found" };
        return Err(Diagnostic::new("U101", place, format!("\"{name}\" {problem}; looked in: {}", path.display()))
            .expected("a path relative to this file, or package://NAME/PATH")
            .fix(hint));
    };
    let real = fs::canonicalize(&path)
        .map_err(|error| Diagnostic::new("U101", place.clone(), format!("\"{name}\" cannot be followed: {error}")))?;
    let allowed = allowed_roots(&search.folder, more_roots, search.options);
    if !allowed.iter().any(|root| real.starts_with(root)) {
        let roots: Vec<String> = allowed.iter().map(|root| root.display().to_string()).collect();
        return Err(Diagnostic::new(
            "U103",
            place,
            format!("\"{name}\" leads to {}, outside the model's folders", real.display()),
        )
        .expected(format!("a file below {}", roots.join(" or ")))
        .fix("--package NAME=DIR with a DIR that contains both, or move the file"));
    }
    Ok(Resolved { path, notes })
}

/// Canonical folders that files may come from: the model's own, its package's, and those given or found by name.
fn allowed_roots(folder: &Path, more_roots: &[PathBuf], options: &ResolveOptions) -> Vec<PathBuf> {
    let above = folders_above(folder);
    let mut roots: Vec<PathBuf> = above.first().cloned().into_iter().collect();
    if let Some(package) = above.iter().find(|dir| dir.join("package.xml").is_file()) {
        roots.push(package.clone());
    } else if let [own, parent, ..] = above.as_slice()
        && own.file_name().is_some_and(|name| MODEL_FOLDERS.iter().any(|known| name == *known))
    {
        roots.push(parent.clone());
    }
    let named = options.packages.iter().map(|(_, root)| root).chain(more_roots);
    roots.extend(named.filter_map(|root| fs::canonicalize(root).ok()));
    roots.dedup();
    roots
}

/// `path` when there is a file, else the only file whose path differs in the case of letters alone, with a remark.
fn existing(path: &Path) -> Option<(PathBuf, Vec<String>)> {
    if path.is_file() {
        return Some((path.to_owned(), Vec::new()));
    }
    let mut found = PathBuf::new();
    for component in path.components() {
        let next = found.join(component);
        let Component::Normal(wanted) = component else {
            found = next;
            continue;
        };
        if next.exists() {
            found = next;
            continue;
        }
        let wanted = wanted.to_str()?.to_lowercase();
        let parent = if found.as_os_str().is_empty() { Path::new(".") } else { &found };
        let mut same = fs::read_dir(parent)
            .ok()?
            .take(MAX_ENTRIES_FOR_HINT)
            .filter_map(Result::ok)
            .filter(|entry| entry.file_name().to_str().is_some_and(|name| name.to_lowercase() == wanted));
        let entry = same.next()?;
        if same.next().is_some() {
            return None;
        }
        found.push(entry.file_name());
    }
    let remark =
        format!("{} does not exist, {} is taken: the case of letters differs", path.display(), found.display());
    found.is_file().then(|| (found, vec![remark]))
}

/// A file with the same last name below `folder`.
fn same_name_below(folder: &Path, wanted: &Path) -> Option<PathBuf> {
    let name = wanted.file_name()?;
    let mut left = MAX_ENTRIES_FOR_HINT;
    let mut waiting = vec![folder.to_owned()];
    while let Some(dir) = waiting.pop() {
        let Ok(listed) = fs::read_dir(dir) else { continue };
        let mut entries: Vec<PathBuf> = listed.take(left).filter_map(Result::ok).map(|entry| entry.path()).collect();
        left = left.saturating_sub(entries.len());
        entries.sort();
        for path in entries {
            let Ok(metadata) = fs::symlink_metadata(&path) else { continue };
            if metadata.is_file() && path.file_name() == Some(name) {
                return Some(path);
            }
            if metadata.is_dir() {
                waiting.push(path);
            }
        }
    }
    None
}
