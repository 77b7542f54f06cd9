//! A browser's developer tools, by the pipes that it offers: what no script of a page can do, as touch its screen.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::Command;

use serde_json::{Value, json};

/// Two pipes in a folder: the browser reads commands from the one and writes results to the other, each ended by a 0.
pub struct Pipes([PathBuf; 2]);

impl Pipes {
    pub fn new(folder: &Path) -> Pipes {
        let pipes = ["commands", "results"].map(|name| folder.join(name));
        assert!(Command::new("mkfifo").args(&pipes).status().unwrap().success());
        Pipes(pipes)
    }

    /// A command that starts a browser at these pipes, which it expects as its files 3 and 4.
    pub fn command(&self, browser: &Path) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", "exec \"$@\" 3<\"$COMMANDS\" 4>\"$RESULTS\"", "sh"]).arg(browser);
        command.env("COMMANDS", &self.0[0]).env("RESULTS", &self.0[1]).arg("--remote-debugging-pipe");
        command
    }

    /// The developer tools of the browser that was started.
    pub fn open(self) -> Devtools {
        let [commands, results] = self.0;
        // Each waits for the other end, in the order in which the shell opens them.
        let commands = OpenOptions::new().write(true).open(commands).unwrap();
        let results = BufReader::new(File::open(results).unwrap());
        Devtools { commands, results, n_sent: 0, page: None }
    }
}

/// The developer tools of a browser with one page.
pub struct Devtools {
    commands: File,
    results: BufReader<File>,
    n_sent: u64,
    /// The session with the page.
    page: Option<Value>,
}

impl Devtools {
    /// Does on the page what a command asks for: `{"method": "Input.dispatchTouchEvent", "params": {...}}`.
    pub fn on_page(&mut self, command: &[u8]) {
        if self.page.is_none() {
            let targets = self.sent(json!({ "method": "Target.getTargets" }));
            let pages = targets["targetInfos"].as_array().unwrap().iter();
            let page = pages.into_iter().find(|target| target["url"].as_str().unwrap().contains("page.html")).unwrap();
            let params = json!({ "targetId": page["targetId"], "flatten": true });
            let attached = self.sent(json!({ "method": "Target.attachToTarget", "params": params }));
            self.page = Some(attached["sessionId"].clone());
        }
        let mut command: Value = serde_json::from_slice(command).unwrap();
        command["sessionId"] = self.page.clone().unwrap();
        self.sent(command);
    }

    /// The result of a command.
    fn sent(&mut self, mut command: Value) -> Value {
        self.n_sent += 1;
        command["id"] = self.n_sent.into();
        write!(self.commands, "{command}\0").unwrap();
        loop {
            let mut message = Vec::new();
            assert!(0 < self.results.read_until(0, &mut message).unwrap(), "the browser has ended");
            message.pop();
            let message: Value = serde_json::from_slice(&message).unwrap();
            // Others are events.
            if message["id"] == command["id"] {
                assert!(message["error"].is_null(), "{command}: {message}");
                return message["result"].clone();
            }
        }
    }
}
