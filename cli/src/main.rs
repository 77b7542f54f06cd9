//! The command line: reads the arguments, runs one command, prints its error and chooses the exit code.

mod commands;

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use offtrack_commands::program;
use offtrack_evaluation::provenance;
use offtrack_learner::error::Error;

use commands::{bench, scale, train};

/// Batches of tensors are allocated thousands of times a second; the system's allocator takes a third of an update's
/// time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

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
    #[command(flatten)]
    Other(program::Command),
    Scale(scale::Args),
    Bench(bench::Args),
}

fn main() -> ExitCode {
    provenance::set_commit(offtrack_commit::commit!());
    let command = match program::parsed::<Cli>(&std::env::args_os().collect::<Vec<_>>()) {
        Ok(cli) => cli.command.unwrap_or(Command::Train(train::Args::default())),
        Err(code) => return code.into(),
    };
    if !matches!(command, Command::Train(_)) {
        // Training has a handler of its own, which stops the run and writes it.
        program::end_on_signals();
    }
    let done = program::start_threads().map_err(Error::from).and_then(|()| match &command {
        Command::Train(args) => train::run(args).map(|()| true),
        Command::Scale(args) => scale::run(args).map(|()| true),
        Command::Bench(args) => bench::run(args).map(|()| true),
        Command::Other(command) => Ok(command.run()?),
    });
    program::exit_code(done, Error::is_wrong_input).into()
}
