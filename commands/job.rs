//! One job: what is read, made and written for one report.

use crate::context::Context;
use crate::destination::{Beside, Extra, Target};
use crate::exit::Exit;
pub use crate::found::Found;
use crate::machine::{Moment, peak_bytes};
use crate::progress::Recorder;
use crate::streams::{complain, say};
use crate::taken::Taken;
use crate::words;
use scantle::anim::Clip;
use scantle::error::{Error, Result};
use scantle::image::samples::Image;
use scantle::io::format::{Format, Kind};
use scantle::io::geotiff::Raster;
use scantle::io::sink::Sink;
use scantle::io::source::Source;
use scantle::io::{self, Content};
use scantle::mesh::Mesh;
use scantle::points::Splats;
use scantle::progress::Progress;
use scantle::protein::Molecule;
use scantle::report::{Input, Output, Report, Run, SCHEMA, Stage, Warning};
use scantle::terrain::Grid;
use scantle::terrain::Transform;
use scantle::vector::{Layer, Raised};
use scantle::volume::Volume;
use serde::Serialize;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// One job: reads, writes, and keeps what the report will say about that.
pub struct Job<'a> {
    context: &'a Context<'a>,
    words: &'a [String],
    format: Option<Format>,
    output: Option<Target>,
    extras: Vec<Beside>,
    /// What went wrong without ending the job.
    aside: Vec<Error>,
    recorder: Recorder,
    read: Vec<Input>,
    written: Vec<Output>,
    warnings: Vec<Warning>,
    opened: usize,
    taken: Option<&'a Mutex<Taken>>,
    is_alone: bool,
    skips_bad: bool,
}

impl<'a> Job<'a> {
    pub(crate) fn new(
        context: &'a Context<'a>,
        words: &'a [String],
        format: Option<Format>,
        start: Moment,
        with_bar: bool,
    ) -> Self {
        Job {
            context,
            words,
            format,
            output: None,
            extras: Vec::new(),
            aside: Vec::new(),
            recorder: Recorder::new(start, with_bar),
            read: Vec::new(),
            written: Vec::new(),
            warnings: Vec::new(),
            opened: 0,
            taken: None,
            is_alone: true,
            skips_bad: false,
        }
    }

    /// One of several, so that what it says names its input.
    pub(crate) fn among_others(mut self, several: bool) -> Self {
        self.is_alone = !several;
        self
    }

    /// Where it writes; `taken` are the places of all jobs.
    pub(crate) fn send_to(
        &mut self,
        output: Option<Target>,
        extras: Vec<Beside>,
        taken: &'a Mutex<Taken>,
    ) {
        self.output = output;
        self.extras = extras;
        self.taken = Some(taken);
    }

    /// Who hears how far the work is.
    pub fn progress(&self) -> &dyn Progress {
        &self.recorder
    }

    /// The format of the result, if one is to be written.
    pub fn output_format(&self) -> Option<Format> {
        self.output.as_ref().map(|target| target.format)
    }

    /// The format in which a result of a kind is written, if one is.
    pub fn output_format_for(&self, kind: Kind) -> Option<Format> {
        self.output.as_ref().map(|target| target.format_for(kind))
    }

    /// Leaves bad points out of the clouds that are read from here on, when `skips` is true; see
    /// [`Source::skipping_bad`].
    pub fn skip_bad(&mut self, skips: bool) {
        self.skips_bad = skips;
    }

    /// Refuses, before any work, a result whose kind the output format cannot hold.
    pub fn expect_output(&self, kinds: &[Kind]) -> Result<()> {
        match &self.output {
            Some(target)
                if !kinds
                    .iter()
                    .any(|kind| target.format_for(*kind).kind() == *kind) =>
            {
                let made: Vec<_> = kinds.iter().map(|kind| kind.with_article()).collect();
                let (made, held) = (made.join(" or "), target.format.kind().with_article());
                Err(target.wrong(format!("holds {held}, but {made} is made here")))
            }
            _ => Ok(()),
        }
    }

    /// The error of a place that the result cannot go to.
    pub fn wrong_output(&self, problem: impl Into<String>) -> Error {
        match &self.output {
            Some(target) => target.wrong(problem),
            None => Error::parameter("output", "", problem),
        }
    }

    /// Reads the next input.
    pub fn read(&mut self) -> Result<Content> {
        self.read_with(io::read)
    }

    /// Reads the next input, which must be a mesh.
    pub fn read_mesh(&mut self) -> Result<Mesh> {
        self.read_with(io::read_mesh)
    }

    /// Reads the next input, which must be splats.
    pub fn read_splats(&mut self) -> Result<Splats> {
        self.read_with(io::read_splats)
    }

    /// Reads the next input, which must be a volume.
    pub fn read_volume(&mut self) -> Result<Volume> {
        self.read_with(io::read_volume)
    }

    /// Reads the next input, which must be a molecule.
    pub fn read_molecule(&mut self) -> Result<Molecule> {
        self.read_with(io::read_molecule)
    }

    /// Reads the next input, which must be an image.
    pub fn read_image(&mut self) -> Result<Image> {
        self.read_with(io::read_image)
    }

    /// Reads the next input, which must be an animation.
    pub fn read_animation(&mut self) -> Result<Clip> {
        self.read_with(io::read_animation)
    }

    /// Reads the next input, which must be heights on a map; see [`io::read_terrain`] for `cell`.
    #[allow(dead_code)]
    pub fn read_terrain(&mut self, cell: Option<[f64; 2]>) -> Result<Grid> {
        self.read_with(|source, format| io::read_terrain(source, format, cell))
    }

    /// Reads the next input, which must be features on a map.
    #[allow(dead_code)]
    pub fn read_vectors(&mut self) -> Result<Layer> {
        self.read_with(io::read_vectors)
    }

    /// Reads the next input, which must be JSON.
    pub fn read_report(&mut self) -> Result<Vec<Value>> {
        self.read_with(io::read_report)
    }

    fn read_with<T>(
        &mut self,
        reader: impl Fn(&Source, Option<Format>) -> Result<(T, Input, Vec<Warning>)>,
    ) -> Result<T> {
        self.recorder.stage("read", 0);
        let word = &self.words[self.opened];
        self.opened += 1;
        let source = Source::open(word, self.context.memory())?.skipping_bad(self.skips_bad);
        let (content, input, warnings) = reader(&source, self.format)?;
        self.read.push(input);
        self.warn(warnings);
        Ok(content)
    }

    /// Reads the next input by a reader of its own, which is given the word, the format where the user says
    /// so, and the bytes that may be held.
    pub fn read_as<T>(
        &mut self,
        reader: impl FnOnce(&str, Option<Format>, u64) -> Result<(T, Vec<Input>, Vec<Warning>)>,
    ) -> Result<T> {
        let (words, format) = (self.words, self.format);
        let word = &words[self.opened];
        self.opened += 1;
        self.read_beside(|memory| reader(word, format, memory))
    }

    /// Reads what an option names.
    pub fn read_beside<T>(
        &mut self,
        reader: impl FnOnce(u64) -> Result<(T, Vec<Input>, Vec<Warning>)>,
    ) -> Result<T> {
        self.recorder.stage("read", 0);
        let (content, inputs, warnings) = reader(self.context.memory())?;
        self.read.extend(inputs);
        self.warn(warnings);
        Ok(content)
    }

    /// The words of the inputs.
    pub fn words(&self) -> &[String] {
        self.words
    }

    /// Errors when what is about to be made needs more bytes than may be held.
    pub fn expect_room(&self, what: &str, needed: u128) -> Result<()> {
        let limit = self.context.memory();
        if needed > u128::from(limit) {
            return Err(Error::over_memory(
                what,
                needed,
                limit,
                Some("raise --max-memory"),
            ));
        }
        Ok(())
    }

    /// What the report says about the input read last.
    pub fn input(&self) -> Option<&Input> {
        self.read.last()
    }

    /// Adds warnings to the report and, unless `--quiet`, to standard error.
    pub fn warn(&mut self, warnings: Vec<Warning>) {
        self.warnings.extend(warnings);
    }

    /// Writes the result, if the user wants it.
    pub fn write_mesh(&mut self, mesh: &Mesh) -> Result<()> {
        self.write_with(Kind::Mesh, |sink, format| {
            io::write_mesh(mesh, sink, format)
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_splats(&mut self, splats: &Splats) -> Result<()> {
        self.write_with(Kind::Splats, |sink, format| {
            io::write_splats(splats, sink, format)
        })
    }

    /// Writes the result, if the user wants it, in a format that the name of its file does not tell.
    pub fn write_splats_as(&mut self, splats: &Splats, format: Format) -> Result<()> {
        self.write_with(Kind::Splats, |sink, _| {
            io::write_splats(splats, sink, format)
        })
    }

    /// Whether the result is a file for each of what a placeholder stands for.
    pub fn is_pattern(&self, placeholder: &str) -> bool {
        self.output
            .as_ref()
            .is_some_and(|target| target.is_pattern(placeholder))
    }

    /// Where the result goes that is one of several: the placeholder made into a word.
    fn place_of(&self, placeholder: &str, word: &str) -> Option<PathBuf> {
        let target = self.output.as_ref()?;
        let path = target.place.sink.path().display().to_string();
        Some(path.replace(placeholder, word).into())
    }

    /// Refuses, before any work, files of one of several results that would go over what is read, or
    /// where something else goes.
    pub fn expect_each(
        &self,
        placeholder: &str,
        words: impl Iterator<Item = String>,
    ) -> Result<()> {
        let (Some(target), Some(taken)) = (&self.output, self.taken) else {
            return Ok(());
        };
        if !target.is_pattern(placeholder) {
            return Ok(());
        }
        let mut taken = taken.lock().expect("no one panics with it");
        for path in words.filter_map(|word| self.place_of(placeholder, &word)) {
            taken.take(&target.at(&path).writes())?;
        }
        Ok(())
    }

    /// Writes the mesh of one label or frame, where there is a file for each; see [`Job::expect_each`].
    pub fn write_each(&mut self, placeholder: &str, word: &str, mesh: &Mesh) -> Result<()> {
        let path = self.place_of(placeholder, word);
        let target = self.output.as_ref().zip(path);
        let own = target.map(|(target, path)| target.at(&path));
        let all = std::mem::replace(&mut self.output, own);
        let written = self.write_mesh(mesh);
        self.output = all;
        written
    }

    /// Writes the result, if the user wants it.
    pub fn write_volume(&mut self, volume: &Volume) -> Result<()> {
        if let Some(format) = self.output_format() {
            let (needed, limit) = (io::room_to_write(volume, format), self.context.memory());
            if needed > u128::from(limit) {
                let [x, y, z] = volume.frame.dims;
                let what = format!("writing {x} x {y} x {z} voxels as {}", format.name());
                let hint = Some("write svo or vdb, which are sparse, or raise --max-memory");
                return Err(Error::over_memory(what, needed, limit, hint));
            }
        }
        self.write_with(Kind::Volume, |sink, format| {
            io::write_volume(volume, sink, format)
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_image(&mut self, image: &Image) -> Result<()> {
        self.write_with(Kind::Image, |sink, format| {
            Ok((io::write_image(image, sink, format)?, Vec::new()))
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_molecule(&mut self, molecule: &Molecule) -> Result<()> {
        self.write_with(Kind::Molecule, |sink, format| {
            io::write_molecule(molecule, sink, format)
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_animation(&mut self, clip: &Clip) -> Result<()> {
        self.write_with(Kind::Animation, |sink, format| {
            io::write_animation(clip, sink, format)
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_terrain(&mut self, grid: &Grid) -> Result<()> {
        self.write_with(Kind::Terrain, |sink, format| {
            io::write_terrain(grid, sink, format)
        })
    }

    /// Writes the result, if the user wants it.
    pub fn write_vectors(&mut self, layer: &Layer) -> Result<()> {
        self.write_with(Kind::Vectors, |sink, format| {
            io::write_vectors(layer, sink, format).map(|outputs| (outputs, Vec::new()))
        })
    }

    /// Writes a picture, with a world file beside it where it has a place on the map, if the user wants it.
    pub fn write_map(&mut self, image: &Image, place: Option<&Transform>) -> Result<()> {
        self.write_with(Kind::Image, |sink, format| {
            Ok((io::write_map(image, place, sink, format)?, Vec::new()))
        })
    }

    /// Writes a raster on the map, if the user wants it.
    pub fn write_raster(&mut self, raster: &Raster) -> Result<()> {
        self.write_with(Kind::Terrain, |sink, format| {
            Ok((io::write_raster(raster, sink, format)?, Vec::new()))
        })
    }

    /// Writes features with heights, if the user wants them.
    pub fn write_raised_vectors(&mut self, layer: &Layer, shapes: &[Raised]) -> Result<()> {
        self.write_with(Kind::Vectors, |sink, format| {
            io::write_raised_vectors(layer, shapes, sink, format).map(|all| (all, Vec::new()))
        })
    }

    /// Writes the bytes of the result, which is in the format of its place, if the user wants it.
    pub fn write_bytes(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(kind) = self.output_format().map(Format::kind) else {
            return Ok(());
        };
        self.write_with(kind, |sink, format| {
            let output = sink.write(format, |out| out.write_all(bytes))?;
            Ok((vec![output], Vec::new()))
        })
    }

    fn write_with(
        &mut self,
        kind: Kind,
        writer: impl FnOnce(&Sink, Format) -> Result<(Vec<Output>, Vec<Warning>)>,
    ) -> Result<()> {
        let Some(target) = &self.output else {
            return Ok(());
        };
        self.recorder.stage("write", 0);
        target.place.prepare()?;
        let written = writer(&target.place.sink, target.format_for(kind));
        let (outputs, warnings) = written.map_err(|error| match error {
            // The library knows the format, not what named it.
            Error::Parameter {
                option: "output-format",
                problem,
                ..
            } => target.wrong(problem),
            other => other,
        })?;
        self.written.extend(outputs);
        self.warn(warnings);
        Ok(())
    }

    /// Draws and writes a picture (the bytes of a PNG file), if the user wants one; see [`Job::write_also`].
    pub fn write_preview(&mut self, draw: impl FnOnce(&dyn Progress) -> Result<Vec<u8>>) {
        self.write_also(Extra::PREVIEW.option, |progress, _| draw(progress));
    }

    /// The file that the result is written to, if it goes to one.
    pub fn output_path(&self) -> Option<&Path> {
        let sink = self.output.as_ref().map(|target| &target.place.sink);
        sink.filter(|sink| **sink != Sink::Stdout).map(Sink::path)
    }

    /// Makes and writes what an option asks for beside the result (the bytes of the file, in the format
    /// that is named), if the user wants it.
    ///
    /// Where that fails the job goes on: the result stands already, and its report is still due.
    pub fn write_also(
        &mut self,
        option: &'static str,
        make: impl FnOnce(&dyn Progress, &str) -> Result<Vec<u8>>,
    ) {
        let Some(beside) = self.extras.iter().find(|beside| beside.option == option) else {
            return;
        };
        self.recorder.stage(option, 0);
        let made = make(&self.recorder, beside.format).and_then(|bytes| {
            self.recorder.stage("write", 0);
            beside.place.prepare()?;
            let sink = &beside.place.sink;
            sink.write_as(beside.format, |out| out.write_all(&bytes))
        });
        match made {
            Ok(output) => self.written.push(output),
            Err(error) => self.set_aside(error),
        }
    }

    /// Keeps what went wrong with a part of the work until the end of the job, which goes on: it is said
    /// then, and the exit code tells it.
    pub fn set_aside(&mut self, error: Error) {
        self.aside.push(error);
    }

    /// Ends the job: says what is for people, and returns the report's bytes and the exit code.
    pub(crate) fn finish<P: Serialize, R: Serialize>(
        mut self,
        command: &'static str,
        found: Found<P, R>,
        alone: bool,
    ) -> (Vec<u8>, Exit) {
        let stages = self.recorder.finish();
        let failure = found.failure();
        self.tell(&found.summary, &stages);
        if let Some(why) = &failure {
            say(format_args!("{}: check failed: {why}", self.words[0]));
        }
        let mut exit = failure.map_or(Exit::Done, |_| Exit::CheckFailed);
        exit = exit.max(self.complain_aside());
        let run = self.context.common().timings.then(|| Run {
            wall_s: stages.iter().map(|stage| stage.wall_s).sum(),
            cpu_s: stages.iter().map(|stage| stage.cpu_s).sum(),
            peak_bytes: peak_bytes(),
            threads: self.context.threads(),
            stages,
        });
        let report = Report {
            schema: SCHEMA,
            scantle: env!("CARGO_PKG_VERSION").to_owned(),
            command: command.to_owned(),
            input: self.read,
            output: self.written,
            parameters: found.parameters,
            result: found.result,
            accuracy: found.accuracy,
            modelled: found.modelled,
            warnings: self.warnings,
            varies: Vec::new(),
            run,
        };
        (words::json(&report, alone), exit)
    }

    /// Ends the job that failed: says why, with the file that it is about.
    pub(crate) fn fail(mut self, error: Error) -> Exit {
        self.recorder.finish();
        let aside = self.complain_aside();
        aside.max(self.complain(error))
    }

    /// Says all that was set aside.
    fn complain_aside(&mut self) -> Exit {
        let aside = std::mem::take(&mut self.aside).into_iter();
        let exits = aside.map(|error| self.complain(error));
        exits.max().unwrap_or(Exit::Done)
    }

    /// Says what went wrong, with the file that it is about.
    fn complain(&self, error: Error) -> Exit {
        let file = &self.words[self.opened.saturating_sub(1)];
        let error = match error {
            Error::Geometry(fault) => Error::Malformed {
                path: file.into(),
                fault,
            },
            other => other,
        };
        // An option is wrong for the run as a whole, where there is one input.
        let is_alone = self.is_alone && matches!(error, Error::Parameter { .. });
        complain(&error, Some(&**file).filter(|_| !is_alone))
    }

    fn tell(&self, summary: &str, stages: &[Stage]) {
        let talk = &self.context.common().talk;
        if talk.quiet {
            return;
        }
        let file = &self.words[0];
        if talk.verbose {
            for input in &self.read {
                say(format_args!("{}: {}", input.path, words::input(input)));
            }
        }
        for warning in &self.warnings {
            say(format_args!("{file}: warning: {}", words::warning(warning)));
        }
        let written: String = self.written.iter().map(words::output).collect();
        say(format_args!("{file}: {summary}{written}"));
        if talk.verbose {
            for stage in stages {
                let (wall, cpu) = (stage.wall_s, stage.cpu_s);
                say(format_args!(
                    "{file}: {} took {wall:.3} s, {cpu:.3} s of processor time",
                    stage.name
                ));
            }
        }
    }
}
