//! A page in headless Chromium, served from this machine: what it asks for, and what it gives back.
//!
//! The browser computes on the processor, at the limits that every device of WebGPU has.

use std::collections::HashMap;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::process::{Child, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Sender, SyncSender, channel, sync_channel};
use std::time::{Duration, Instant};

use super::devtools::Pipes;
use crate::browser::browser;

/// Longest time that a page may take.
const PATIENCE: Duration = Duration::from_secs(400);
/// Longest time that a connection may say nothing: a browser opens some ahead of need.
const SILENCE: Duration = Duration::from_secs(20);
/// The adapter of these flags computes on the processor. With a canvas the device is lost without the last four.
const FLAGS: [&str; 11] = [
    "--headless=new",
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--no-first-run",
    "--enable-unsafe-webgpu",
    "--use-webgpu-adapter=swiftshader",
    "--enable-features=Vulkan",
    "--use-vulkan=swiftshader",
    "--use-angle=swiftshader",
    "--disable-vulkan-surface",
    "--disable-gpu-watchdog",
];
/// The policy of the page's contents forbids it to load anything; a test's page may talk to the test.
const FORBIDS: &str = "default-src 'none';";
const ALLOWS: &str = "default-src 'none'; connect-src 'self'; form-action 'self';";
/// Where a page says that it is done, and what went wrong.
const DONE: &str = "done";
const FAILED: &str = "failed";

/// Where a page says what the browser's developer tools are to do.
const DEVTOOLS: &str = "devtools";

/// What a page gave, by the name that it gave it.
pub type Given = HashMap<String, Vec<u8>>;

/// Opens a page in a browser with these flags beside its own, with files by their names, until the page says that it is
/// done. A page that says that it failed fails the test.
pub fn given_by(page: &str, files: HashMap<String, Vec<u8>>, without_gpu: bool) -> Given {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let port = listener.local_addr().unwrap().port();
    assert!(page.contains(FORBIDS), "the page may load something");
    let mut files = files;
    files.insert("page.html".to_owned(), page.replacen(FORBIDS, ALLOWS, 1).into_bytes());
    let (sender, given) = channel();
    let files = Arc::new(files);
    std::thread::spawn(move || {
        for connection in listener.incoming().map_while(Result::ok) {
            let (files, sender) = (files.clone(), sender.clone());
            std::thread::spawn(move || answer(connection, &files, &sender));
        }
    });
    let profile = tempfile::tempdir().unwrap();
    let pipes = Pipes::new(profile.path());
    let flags = FLAGS.iter().filter(|flag| !without_gpu || !flag.contains("webgpu"));
    let _browser = Running(
        pipes
            .command(&browser())
            .args(flags)
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg(format!("http://127.0.0.1:{port}/page.html"))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap(),
    );
    let mut devtools = pipes.open();
    let (started, mut all) = (Instant::now(), Given::new());
    loop {
        let left = PATIENCE.saturating_sub(started.elapsed());
        let Post { name, body, .. } =
            given.recv_timeout(left).unwrap_or_else(|_| panic!("the page is not done; it gave {:?}", all.keys()));
        assert!(name != FAILED, "the page failed: {}", String::from_utf8_lossy(&body));
        if name == DONE {
            return all;
        }
        if name == DEVTOOLS {
            devtools.on_page(&body);
        } else {
            all.insert(name, body);
        }
    }
}

/// What a page posts. It is answered when the test is done with it and drops `_taken`.
struct Post {
    name: String,
    body: Vec<u8>,
    _taken: SyncSender<()>,
}

/// A browser that is ended with the test.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Answers one request of a page.
fn answer(connection: TcpStream, files: &HashMap<String, Vec<u8>>, sender: &Sender<Post>) {
    let _ = connection.set_read_timeout(Some(SILENCE));
    let mut reader = BufReader::new(&connection);
    let mut line = String::new();
    let Ok(1..) = reader.read_line(&mut line) else { return };
    let (mut length, first) = (0, line.clone());
    loop {
        line.clear();
        let Ok(1..) = reader.read_line(&mut line) else { return };
        if line.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().unwrap_or(0);
        }
    }
    let mut body = vec![0; length];
    if reader.read_exact(&mut body).is_err() {
        return;
    }
    let mut words = first.split_whitespace();
    let (method, path) = (words.next().unwrap_or_default(), words.next().unwrap_or_default());
    let name = path.trim_start_matches('/');
    let (status, contents): (&str, &[u8]) = match (method, files.get(name)) {
        ("POST", _) => {
            let (_taken, wait) = sync_channel(0);
            let _ = sender.send(Post { name: name.to_owned(), body, _taken });
            let _ = wait.recv();
            ("200 OK", b"")
        }
        (_, Some(contents)) => ("200 OK", contents),
        _ => ("404 Not Found", b""),
    };
    let kind = if name.ends_with(".html") { "text/html" } else { "application/octet-stream" };
    let head = format!(
        "HTTP/1.1 {status}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\r\n",
        contents.len()
    );
    let mut connection = &connection;
    let _ = connection.write_all(head.as_bytes()).and_then(|()| connection.write_all(contents));
}
