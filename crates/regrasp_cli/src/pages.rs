//! Pages for a browser.

use crate::stop::Stop;
use crate::talk::Talk;
use crate::words::grouped;
use regrasp::base::files;
use regrasp::pictures::{failure_facts, failure_story, reached_story};
use regrasp::plan::check::Report;
use regrasp::robot::ResolveOptions;
use regrasp::viewer::page;
use regrasp::viewer::story::{Outcome, RoadmapStory, Story, Telling, tell};
use regrasp::{Failure, Manipulation, Plan, Query};
use serde_json::json;
use std::path::Path;

/// A page to be written, of what comes of a query.
#[derive(Debug)]
pub struct Page<'a> {
    path: &'a Path,
    task: Manipulation<'a>,
    query: &'a Query,
    packages: &'a ResolveOptions,
}

impl<'a> Page<'a> {
    /// A page at `path`; visual meshes are looked for in `packages`.
    pub fn new(path: &'a Path, task: Manipulation<'a>, query: &'a Query, packages: &'a ResolveOptions) -> Self {
        Page { path, task, query, packages }
    }

    /// Writes the page of a plan, whatever the checker said of it.
    pub fn write_plan(&self, plan: &Plan, report: &Report, talk: &Talk) -> Result<(), Stop> {
        write(self.path, &self.story(Outcome::Planned { plan, report }, Vec::new(), None)?, talk)
    }

    /// Writes the page of a failure.
    pub fn write_failure(&self, failure: &Failure, talk: &Talk) -> Result<(), Stop> {
        let outcome = Outcome::Failed(failure_story(failure));
        let reached = reached_story(failure, self.query.goal());
        write(self.path, &self.story(outcome, failure_facts(failure), reached)?, talk)
    }

    fn story(
        &self,
        outcome: Outcome,
        facts: Vec<(String, String)>,
        roadmap: Option<RoadmapStory>,
    ) -> Result<Story, Stop> {
        let telling = Telling {
            task: self.task,
            query: Some(self.query),
            outcome,
            title: None,
            facts,
            roadmap,
            packages: self.packages,
        };
        story(&telling)
    }
}

/// The story that is told.
pub fn story(telling: &Telling) -> Result<Story, Stop> {
    tell(telling).map_err(Stop::Internal)
}

/// Writes the page of a story and says where it is.
pub fn write(path: &Path, story: &Story, talk: &Talk) -> Result<(), Stop> {
    write_html(path, &page::html(story), talk)
}

/// Writes a page and says where it is.
pub fn write_html(path: &Path, html: &str, talk: &Talk) -> Result<(), Stop> {
    files::write_atomic(path, html.as_bytes()).map_err(|error| Stop::unwritable(path, &error))?;
    talk.event("written", json!({ "page": path, "bytes": html.len(), "sha256": files::sha256(html.as_bytes()) }));
    if let Some(host) = ssh_host() {
        let absolute = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
        talk.say(format!("hint   from your own machine: scp {host}:{} . and open the copy", absolute.display()));
    }
    talk.say(format!("page   {}   {} bytes; open it in a browser", path.display(), grouped(html.len() as u64)));
    Ok(())
}

/// The address under which this machine was reached by ssh, where it was.
fn ssh_host() -> Option<String> {
    // Client address and port, server address and port (sshd(8), environment).
    let connection = std::env::var("SSH_CONNECTION").ok()?;
    Some(connection.split_whitespace().nth(2)?.to_owned())
}
