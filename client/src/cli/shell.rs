use std::fs::create_dir_all;
use std::io;
use std::path::Path;

use anyhow::{Context, Result};
use clap::{Command, CommandFactory};
use clap_complete::{Shell, generate};

use super::args::{Args, CompletionsArgs, ManArgs};
use super::output;

/// Prints the completions of this command line.
pub(crate) fn completions(args: &CompletionsArgs) -> Result<()> {
    output::line(completion_text(args.shell, &mut Args::command())?.trim_end())?;
    Ok(())
}

/// Writes the man pages of this command line, one for itself and one for each command.
pub(crate) fn man(args: &ManArgs) -> Result<()> {
    let folder = &args.output;
    let pages = write_pages(folder, Args::command());
    pages.with_context(|| folder.display().to_string())?;
    output::note(&format!("read it: man {}/tsukamu.1", folder.display()));
    Ok(())
}

fn completion_text(shell: Shell, command: &mut Command) -> Result<String> {
    let mut text = Vec::new();
    let name = command.get_name().to_owned();
    generate(shell, command, name, &mut text);
    Ok(String::from_utf8(text)?)
}

fn write_pages(folder: &Path, command: Command) -> io::Result<()> {
    create_dir_all(folder)?;
    clap_mangen::generate_to(command, folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Names of all commands.
    fn names() -> Vec<String> {
        let command = Args::command();
        let names = command.get_subcommands().map(Command::get_name);
        names.map(str::to_owned).collect()
    }

    #[test]
    fn completions_know_every_command() {
        assert!(names().len() > 12, "{:?}", names());
        for shell in [Shell::Bash, Shell::Zsh, Shell::Fish] {
            let text = completion_text(shell, &mut Args::command()).expect("completions");
            for name in names() {
                assert!(text.contains(&name), "{shell}: {name}");
            }
        }
    }

    #[test]
    fn every_command_has_a_man_page() {
        let folder = std::env::temp_dir().join(format!("tsukamu-man-{}", std::process::id()));
        write_pages(&folder, Args::command()).expect("pages");
        let page = |name: &str| std::fs::read_to_string(folder.join(name)).expect(name);
        let main = page("tsukamu.1");
        for name in names() {
            let page = page(&format!("tsukamu-{name}.1"));
            assert!(page.contains(".SH SYNOPSIS"), "{page}");
            // In roff a hyphen is escaped.
            let mention = format!("tsukamu\\-{name}(1)");
            assert!(main.contains(&mention), "{mention}: {main}");
        }
        std::fs::remove_dir_all(folder).expect("the test's own folder");
    }
}
