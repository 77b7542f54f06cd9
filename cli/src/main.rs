//! The command line: reads the arguments, runs one command, prints its error and chooses the exit code.

mod commands;

use std::ffi::OsString;
use std::process::ExitCode;

use clap::{Parser, Subcommand};
use offtrack::files::reader::shortened;
use offtrack_evaluation::{files, provenance};
use offtrack_learner::error::Error;

use commands::{
    bench, board, certify, compare, deviations, devices, draw, evaluate, fits, generate, import, record, scale, trace,
    train, vehicles,
};

/// Batches of tensors are allocated thousands of times a second; the system's allocator takes a third of an update's
/// time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Exit code of a failure on valid input.
const FAILED: u8 = 1;
/// Exit code of wrong input; clap exits with it too.
const WRONG_INPUT: u8 = 2;
/// Exit code after Ctrl-C, as shells give it: 128 and the number of the signal.
const INTERRUPTED: i32 = 130;

const AFTER_HELP: &str = "\
Without a command `offtrack` trains, as `offtrack train` does.

Exit codes:
  0    done; training that Ctrl-C stopped once, with everything written
  1    failed on valid input: device, disk, learner, a certificate or an entry of the board that does not hold, a
       vehicle that does not fit
  2    wrong input: arguments or files
  130  interrupted: by Ctrl-C, in training by a second one";

/// Tractor-trailers learn to drive through roundabouts.
#[derive(Debug, Parser)]
#[command(name = "offtrack", version, after_help = AFTER_HELP)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Train(train::Args),
    Evaluate(evaluate::Args),
    Compare(compare::Args),
    Board(board::Args),
    Scale(scale::Args),
    Bench(bench::Args),
    Devices(devices::Args),
    Certify(certify::Args),
    Draw(draw::Args),
    Fits(fits::Args),
    Generate(generate::Args),
    Import(import::Args),
    Vehicles(vehicles::Args),
    Record(record::Args),
    Trace(trace::Args),
    Deviations(deviations::Args),
}

fn main() -> ExitCode {
    provenance::set_commit(offtrack_commit::commit!());
    let command = match parsed(&std::env::args_os().collect::<Vec<_>>()) {
        Ok(cli) => cli.command.unwrap_or(Command::Train(train::Args::default())),
        Err(code) => return code,
    };
    if !matches!(command, Command::Train(_)) {
        // Training has a handler of its own, which stops the run and writes it.
        let _ = ctrlc::set_handler(|| {
            files::remove_temporaries();
            std::process::exit(INTERRUPTED);
        });
    }
    let mut is_refuted = false;
    let done = start_threads().and_then(|()| match &command {
        Command::Train(args) => train::run(args),
        Command::Evaluate(args) => Ok(evaluate::run(args)?),
        Command::Compare(args) => Ok(compare::run(args)?),
        Command::Board(args) => Ok(board::run(args).map(|all_hold| is_refuted = !all_hold)?),
        Command::Scale(args) => scale::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Devices(args) => Ok(devices::run(args)?),
        Command::Certify(args) => Ok(certify::run(args)?),
        Command::Draw(args) => Ok(draw::run(args)?),
        Command::Fits(args) => Ok(fits::run(args).map(|all_fit| is_refuted = !all_fit)?),
        Command::Generate(args) => Ok(generate::run(args)?),
        Command::Vehicles(args) => Ok(vehicles::run(args)?),
        Command::Import(args) => Ok(import::run(args)?),
        Command::Record(args) => Ok(record::run(args)?),
        Command::Trace(args) => Ok(trace::run(args)?),
        Command::Deviations(args) => Ok(deviations::run(args)?),
    });
    match done {
        Ok(()) if is_refuted => ExitCode::from(FAILED),
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // With standard error closed, the exit code is all that is left.
            files::say(&error.to_string());
            ExitCode::from(exit_code(&error))
        }
    }
}

/// Most characters of an argument that a message repeats.
const LONGEST_ARGUMENT: usize = 200;

/// Reads the arguments. Where that fails, help or what is wrong has been printed.
fn parsed(arguments: &[OsString]) -> Result<Cli, ExitCode> {
    Cli::try_parse_from(arguments).map_err(|error| {
        // Errors repeat arguments: this one is that of the same command with arguments that do nothing to a terminal.
        let shown = arguments.iter().map(|argument| shortened(&argument.to_string_lossy(), LONGEST_ARGUMENT));
        if let Err(shown) = Cli::try_parse_from(shown) {
            shown.exit();
        }
        // One is not Unicode.
        files::say(&error.kind().to_string());
        ExitCode::from(WRONG_INPUT)
    })
}

fn exit_code(error: &Error) -> u8 {
    if error.is_wrong_input() { WRONG_INPUT } else { FAILED }
}

/// Starts the threads that commands share. Left to the first work on all cores, a system that does not give so many
/// would make it panic.
fn start_threads() -> Result<(), Error> {
    Ok(rayon::ThreadPoolBuilder::new().num_threads(offtrack::files::cache::n_threads()).build_global()?)
}
