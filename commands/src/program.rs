//! What every program of these commands does: arguments are read, one command runs, its error is printed and gives the
//! exit code.

use std::ffi::OsString;
use std::fmt::Display;

use clap::{Parser, Subcommand};
use offtrack::files::reader::shortened;
use offtrack_evaluation::error::Error;
use offtrack_evaluation::files;

use crate::signals::on_signals;
use crate::{
    board, certify, compare, deviations, devices, draw, evaluate, export, fits, generate, import, record, trace,
    traffic, vehicles, web,
};

/// Exit code of a failure on valid input.
pub const FAILED: u8 = 1;
/// Exit code of wrong input; clap exits with it too.
pub const WRONG_INPUT: u8 = 2;
/// Exit code after Ctrl-C, as shells give it: 128 and the number of the signal.
pub const INTERRUPTED: u8 = 130;

/// Most characters of an argument that a message repeats.
const LONGEST_ARGUMENT: usize = 200;

/// A command that needs no learner.
#[derive(Debug, Subcommand)]
#[expect(missing_docs, reason = "each is documented where its arguments are")]
pub enum Command {
    Evaluate(evaluate::Args),
    Compare(compare::Args),
    Board(board::Args),
    Record(record::Args),
    Web(web::Args),
    Certify(certify::Args),
    Fits(fits::Args),
    Draw(draw::Args),
    Traffic(traffic::Args),
    Generate(generate::Args),
    Import(import::Args),
    Export(export::Args),
    Vehicles(vehicles::Args),
    Devices(devices::Args),
    Trace(trace::Args),
    Deviations(deviations::Args),
}

impl Command {
    /// Runs the command. The result is whether what was asked holds: only `fits` and `board` may deny it.
    ///
    /// # Errors
    ///
    /// Wrong input, [`Error::is_wrong_input`], and what else failed.
    pub fn run(&self) -> Result<bool, Error> {
        match self {
            Command::Evaluate(args) => evaluate::run(args),
            Command::Compare(args) => compare::run(args),
            Command::Record(args) => record::run(args),
            Command::Web(args) => web::run(args),
            Command::Certify(args) => certify::run(args),
            Command::Board(args) => return board::run(args),
            Command::Fits(args) => return fits::run(args),
            Command::Draw(args) => draw::run(args),
            Command::Traffic(args) => traffic::run(args),
            Command::Generate(args) => generate::run(args),
            Command::Import(args) => import::run(args),
            Command::Export(args) => export::run(args),
            Command::Vehicles(args) => vehicles::run(args),
            Command::Devices(args) => devices::run(args),
            Command::Trace(args) => trace::run(args),
            Command::Deviations(args) => deviations::run(args),
        }
        .map(|()| true)
    }
}

/// A program of these commands alone.
#[derive(Debug, Parser)]
#[command(name = "offtrack", version, after_help = AFTER_HELP)]
struct Program {
    #[command(subcommand)]
    command: Command,
}

const AFTER_HELP: &str = "\
Exit codes:
  0    done
  1    failed on valid input: device, disk, a certificate or an entry of the board that does not hold, a
       vehicle that does not fit
  2    wrong input: arguments or files
  130  interrupted

`train`, `scale` and `bench` come with the program that is built from source: cargo install --locked --path cli";

/// Commands of the program with a learner.
const LEARNING: [&str; 3] = ["train", "scale", "bench"];

/// A program of these commands alone, for a process of its own: reads the arguments, the program's name first, runs the
/// command and gives the exit code. What went wrong has been printed.
pub fn main(arguments: &[OsString]) -> u8 {
    if let Some(name) = LEARNING.into_iter().find(|name| arguments.get(1).is_some_and(|given| given == name)) {
        files::say(&format!(
            "{name}: this program has no learner; the one that is built from source has: cargo install --locked \
             --path cli"
        ));
        return WRONG_INPUT;
    }
    let Program { command } = match parsed(arguments) {
        Ok(program) => program,
        Err(code) => return code,
    };
    end_on_signals();
    let done = start_threads().map_err(Error::from).and_then(|()| command.run());
    exit_code(done, Error::is_wrong_input)
}

/// The exit code of a command's result. An error is printed; with standard error closed, the exit code is all that is
/// left.
pub fn exit_code<E: Display>(done: Result<bool, E>, is_wrong_input: fn(&E) -> bool) -> u8 {
    match done {
        Ok(true) => 0,
        Ok(false) => FAILED,
        Err(error) => {
            files::say(&error.to_string());
            if is_wrong_input(&error) { WRONG_INPUT } else { FAILED }
        }
    }
}

/// Reads the arguments, the program's name first.
///
/// # Errors
///
/// The exit code where that fails or help was asked for: it, or what is wrong, has been printed.
pub fn parsed<P: Parser>(arguments: &[OsString]) -> Result<P, u8> {
    read::<P, OsString>(arguments.iter().cloned()).map_err(|error| {
        // Errors repeat arguments: this one is that of the same command with arguments that do nothing to a terminal.
        let shown = arguments.iter().map(|argument| shortened(&argument.to_string_lossy(), LONGEST_ARGUMENT));
        let Err(shown) = read::<P, String>(shown) else {
            // One is not Unicode.
            files::say(&error.kind().to_string());
            return WRONG_INPUT;
        };
        // Help that nobody reads is no failure.
        let _ = shown.print();
        shown.exit_code() as u8
    })
}

/// The command of a line of arguments. What looks like a negative number is an option's value, so that an error names
/// the option.
fn read<P: Parser, A: Into<OsString> + Clone>(arguments: impl IntoIterator<Item = A>) -> Result<P, clap::Error> {
    let mut command = P::command().mut_subcommands(|command| command.mut_args(|arg| arg.allow_negative_numbers(true)));
    let mut matches = command.try_get_matches_from_mut(arguments)?;
    P::from_arg_matches_mut(&mut matches).map_err(|error| error.format(&mut command))
}

/// Has Ctrl-C, SIGTERM and SIGHUP end the process with nothing half-written left.
pub fn end_on_signals() {
    on_signals(|| {
        files::remove_temporaries();
        std::process::exit(INTERRUPTED.into());
    });
}

/// Starts the threads that commands share. Left to the first work on all cores, a system that does not give so many
/// would make it panic.
///
/// # Errors
///
/// Threads that cannot be started.
pub fn start_threads() -> Result<(), rayon::ThreadPoolBuildError> {
    rayon::ThreadPoolBuilder::new().num_threads(offtrack::files::cache::n_threads()).build_global()
}
