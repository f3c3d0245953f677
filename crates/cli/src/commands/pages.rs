//! `linelit completions` and `linelit man`: completion scripts for shells, and manual pages.

use crate::args::{Cli, ManArgs};
use crate::output::{Output, note};
use anyhow::{Context as _, Result};
use clap::{Command, CommandFactory as _};
use clap_complete::Shell;
use clap_mangen::Man;

/// Prints a script that completes words in a shell.
pub fn completions(shell: Shell, out: &mut Output) -> Result<()> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "linelit", &mut script);
    write!(out, "{}", String::from_utf8_lossy(&script))?;
    Ok(())
}

/// Prints the manual page of the program, or writes it into a folder with the pages of its
/// commands.
pub fn man(args: &ManArgs, out: &mut Output) -> Result<()> {
    let mut program = Cli::command().disable_help_subcommand(true);
    program.build();
    let Some(dir) = &args.dir else {
        write!(out, "{}", String::from_utf8_lossy(&page(program)?))?;
        return Ok(());
    };
    // Collect all commands, with names such as linelit-plan-render.
    let failed = || format!("creating the folder {}", dir.display());
    std::fs::create_dir_all(dir).with_context(failed)?;
    let mut all = vec![program];
    let mut next = 0;
    while let Some(command) = all.get(next) {
        let (above, below) = (command.get_name().to_owned(), command.get_subcommands());
        let below = below.filter(|command| command.get_name() != "help");
        let named = |command: &Command| {
            let name = format!("{above}-{}", command.get_name());
            command.clone().display_name(name.clone()).name(name)
        };
        let below: Vec<Command> = below.map(named).collect();
        all.extend(below);
        next += 1;
    }
    // Write a page for each.
    for command in all {
        let path = dir.join(format!("{}.1", command.get_name()));
        linelit_film::write_atomically(&path, &page(command)?)?;
        note(format_args!("{}", path.display()));
    }
    Ok(())
}

/// Returns the manual page of a command.
fn page(command: Command) -> Result<Vec<u8>> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    Ok(page)
}
