//! What the commands do when all is well, and how they end when they are stopped.

use crate::folder::{Folder, repository};

#[test]
fn help_and_version_say_what_they_should() {
    let folder = Folder::new();
    let help = folder.run(&["--help"]);
    assert_eq!(help.code, Some(0));
    for word in ["demo", "inspect", "plan", "check", "bench", "--package", "--json", "--quiet", "--lenient"] {
        assert!(help.out.contains(word), "{word} is missing:\n{}", help.out);
    }
    assert_eq!(folder.run(&["--version"]).out.trim(), concat!("regrasp ", env!("CARGO_PKG_VERSION")));
}

/// The files in the binary are those of the repository.
#[test]
fn the_readme_names_only_commands_that_exist() {
    let readme = std::fs::read_to_string(repository().join("README.md")).unwrap();
    let known = ["demo", "inspect", "plan", "check", "bench"];
    for line in readme.lines().filter_map(|line| line.trim().strip_prefix("regrasp ")) {
        let command = line.split(' ').next().unwrap_or_default();
        assert!(known.contains(&command), "README.md: regrasp {line}");
    }
}
