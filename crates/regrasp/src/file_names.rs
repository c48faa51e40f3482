//! What a file that is written calls another one: its path from the folder of the writer for what is in there, else a path within a package
//! given, else one relative to the writer.

use std::path::{Component, Path, PathBuf};

/// How the file at `writer` names `file`.
pub fn name_from(writer: &Path, file: &Path, packages: &[(String, PathBuf)]) -> String {
    // A file that does not exist is told by the place where it was looked for.
    let elsewhere = |path: &Path| std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let absolute = |path: &Path| std::fs::canonicalize(path).unwrap_or_else(|_| elsewhere(path));
    let file = absolute(file);
    let slashed = |path: &Path| path.to_string_lossy().replace('\\', "/");
    let folder = match writer.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => absolute(parent),
        _ => absolute(Path::new(".")),
    };
    // Found without any option, also when the folder has moved.
    if let Ok(inside) = file.strip_prefix(&folder) {
        return slashed(inside);
    }
    for (name, folder) in packages {
        if let Ok(inside) = file.strip_prefix(absolute(folder)) {
            return format!("package://{name}/{}", slashed(inside));
        }
    }
    slashed(&relative(&file, &folder))
}

/// `target` as seen from `folder`, both absolute.
fn relative(target: &Path, folder: &Path) -> PathBuf {
    let (target_parts, folder_parts): (Vec<Component>, Vec<Component>) =
        (target.components().collect(), folder.components().collect());
    let shared = target_parts.iter().zip(&folder_parts).take_while(|(a, b)| a == b).count();
    if shared == 0 {
        return target.to_owned();
    }
    let up = std::iter::repeat_n(Component::ParentDir, folder_parts.len() - shared);
    up.chain(target_parts[shared..].iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_seen_from_the_file_that_names_them() {
        let seen = |target: &str, folder: &str| relative(Path::new(target), Path::new(folder));
        assert_eq!(seen("/a/b/hand.urdf", "/a/b"), PathBuf::from("hand.urdf"));
        assert_eq!(seen("/a/b/hand.urdf", "/a/c/d"), PathBuf::from("../../b/hand.urdf"));
    }

    /// What lies with the writer is found without any option; what lies elsewhere is named by its package.
    #[test]
    fn files_beside_the_writer_are_named_without_their_package() {
        let folder = tempfile::tempdir().unwrap();
        let packages = [("models".to_owned(), folder.path().to_owned())];
        let seen = |writer: &str| {
            let file = folder.path().join("leap/hand.urdf");
            name_from(&folder.path().join(writer), &file, &packages)
        };
        std::fs::create_dir_all(folder.path().join("leap")).unwrap();
        std::fs::create_dir_all(folder.path().join("other")).unwrap();
        std::fs::write(folder.path().join("leap/hand.urdf"), "").unwrap();
        assert_eq!(seen("leap/hand.toml"), "hand.urdf");
        assert_eq!(seen("robot.toml"), "leap/hand.urdf");
        assert_eq!(seen("other/hand.toml"), "package://models/leap/hand.urdf");
    }

    /// As seen from the folder of the scene, and not as it was typed in another one.
    #[test]
    fn files_that_do_not_exist_are_named_by_where_they_were_looked_for() {
        let folder = tempfile::tempdir().unwrap();
        let named = name_from(&folder.path().join("scene.toml"), Path::new("no/such/hand.toml"), &[]);
        let found = folder.path().canonicalize().unwrap().join(named);
        let meant = std::env::current_dir().unwrap().canonicalize().unwrap().join("no/such/hand.toml");
        let plain = |path: &Path| {
            path.components().fold(PathBuf::new(), |mut sum, part| {
                match part {
                    Component::ParentDir => drop(sum.pop()),
                    part => sum.push(part),
                }
                sum
            })
        };
        assert_eq!(plain(&found), plain(&meant));
    }
}
