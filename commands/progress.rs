//! Times the stages of a run and shows a bar to a person who waits.

use crate::machine::Moment;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use scantle::progress::Progress;
use scantle::report::Stage;
use std::io::{self, IsTerminal};
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::Duration;

/// Hears an algorithm's stages: records what each took, and moves the bar if there is one.
pub struct Recorder {
    stages: Mutex<Stages>,
    bar: Option<Bar>,
}

struct Stages {
    ended: Vec<Stage>,
    current: &'static str,
    since: Moment,
}

impl Stages {
    fn end_current(&mut self) {
        let now = Moment::now();
        let (wall_s, cpu_s) = now.since(&self.since);
        self.ended.push(Stage {
            name: self.current.to_owned(),
            wall_s,
            cpu_s,
        });
        self.since = now;
    }
}

impl Recorder {
    /// A recorder whose first stage, `read`, began at `start`.
    pub fn new(start: Moment, with_bar: bool) -> Self {
        let stages = Stages {
            ended: Vec::new(),
            current: "read",
            since: start,
        };
        Recorder {
            stages: Mutex::new(stages),
            bar: with_bar.then(Bar::new),
        }
    }

    /// Ends the last stage and takes the bar away. The stages leave no gap between them.
    pub fn finish(&mut self) -> Vec<Stage> {
        self.bar = None;
        let mut stages = self.lock();
        stages.end_current();
        std::mem::take(&mut stages.ended)
    }

    fn lock(&self) -> MutexGuard<'_, Stages> {
        self.stages.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Progress for Recorder {
    fn stage(&self, name: &'static str, units: u64) {
        let mut stages = self.lock();
        if stages.current != name {
            stages.end_current();
            stages.current = name;
        }
        if let Some(bar) = &self.bar {
            bar.stage(name, units);
        }
    }

    fn advance(&self, units: u64) {
        if let Some(bar) = &self.bar {
            bar.shown.inc(units);
        }
    }
}

/// Whether a bar would be seen by anyone.
pub fn is_watched() -> bool {
    io::stderr().is_terminal()
}

/// A bar that stays hidden for the first second.
struct Bar {
    shown: ProgressBar,
    _alive: Sender<()>,
}

impl Bar {
    fn new() -> Self {
        let shown = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        let (alive, ended) = mpsc::channel::<()>();
        let later = shown.clone();
        thread::spawn(move || {
            if ended.recv_timeout(Duration::from_secs(1)) == Err(RecvTimeoutError::Timeout) {
                later.set_draw_target(ProgressDrawTarget::stderr());
                later.enable_steady_tick(Duration::from_millis(100));
            }
        });
        let bar = Bar {
            shown,
            _alive: alive,
        };
        bar.stage("read", 0);
        bar
    }

    fn stage(&self, name: &'static str, units: u64) {
        let template = if units > 0 {
            "{msg:12} {bar:40} {percent:>3} %  {eta}"
        } else {
            "{msg:12} {spinner} {elapsed}"
        };
        let style = ProgressStyle::with_template(template).expect("the template is well formed");
        self.shown.set_style(style);
        self.shown.set_message(name);
        self.shown.reset();
        if units > 0 {
            self.shown.set_length(units);
        } else {
            self.shown.unset_length();
        }
    }
}

impl Drop for Bar {
    fn drop(&mut self) {
        self.shown.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_add_up_and_a_repeated_one_is_one() {
        let start = Moment::now();
        let mut recorder = Recorder::new(start, true);
        recorder.stage("read", 0);
        recorder.stage("classify", 2);
        recorder.advance(2);
        recorder.stage("write", 0);
        recorder.stage("write", 0);
        let stages = recorder.finish();
        let (wall, _) = Moment::now().since(&start);
        let names: Vec<_> = stages.iter().map(|stage| stage.name.as_str()).collect();
        assert_eq!(names, ["read", "classify", "write"]);
        let sum: f64 = stages.iter().map(|stage| stage.wall_s).sum();
        assert!(sum > 0.0 && sum <= wall);
    }
}
