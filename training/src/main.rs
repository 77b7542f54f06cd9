//! The command line: reads what is asked for, prints an error and chooses the exit code (2 for wrong input, 1 for a failure).

mod commands;

use std::io::Write;
use std::process::ExitCode;

use clap::{Parser, Subcommand};

use commands::{bench, certify, deviations, devices, draw, evaluate, record, scale, trace, train};

/// A large batch's tensors come and go thousands of times a second; the system's allocator takes a third of an update's time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Tractor-trailers learn to drive through roundabouts. Without a command: `train`.
#[derive(Debug, Parser)]
#[command(version, about)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Debug, Subcommand)]
enum Command {
    Train(train::Args),
    Evaluate(evaluate::Args),
    Scale(scale::Args),
    Bench(bench::Args),
    Devices(devices::Args),
    Certify(certify::Args),
    Draw(draw::Args),
    Record(record::Args),
    Trace(trace::Args),
    Deviations(deviations::Args),
}

fn main() -> ExitCode {
    let command = Cli::parse().command.unwrap_or(Command::Train(train::Args::default()));
    let done = match &command {
        Command::Train(args) => train::run(args),
        Command::Evaluate(args) => evaluate::run(args),
        Command::Scale(args) => scale::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Devices(args) => devices::run(args),
        Command::Certify(args) => certify::run(args),
        Command::Draw(args) => draw::run(args),
        Command::Record(args) => record::run(args),
        Command::Trace(args) => trace::run(args),
        Command::Deviations(args) => deviations::run(args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Where nobody reads it, the exit code still tells.
            let _ = writeln!(std::io::stderr(), "offtrack: {error}");
            ExitCode::from(error.exit_code())
        }
    }
}
