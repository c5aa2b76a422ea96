//! The panel as a person uses it, in Chromium driven by ChromeDriver; an error in the page's console fails the test.
//!
//! Skipped where `chromedriver` or `chromium` is not installed; with `REQUIRE_CHROMIUM=1` that is a failure. With `PANEL_SCREENSHOTS=DIR` a
//! picture of every view is left there.
#![cfg(all(feature = "panel", target_os = "linux"))]
#![allow(clippy::unwrap_used, reason = "a test may unwrap: the panic is its report")]

use std::io::{BufRead, BufReader};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// A process that ends with its test.
struct Process(Child);

impl Drop for Process {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Starts a program and waits for a line with this part.
fn start(command: &mut Command, part: &str) -> (Process, String) {
    let mut child = command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    let line = lines.by_ref().map_while(Result::ok).find(|line| line.contains(part));
    // Read on, so that the program never waits for us.
    std::thread::spawn(move || lines.for_each(drop));
    (Process(child), line.unwrap())
}

/// A browser, by the protocol of W3C WebDriver.
struct Browser {
    _driver: Process,
    session: String,
    agent: ureq::Agent,
    /// Profile and downloads.
    folder: PathBuf,
}

const ELEMENT: &str = "element-6066-11e4-a52e-4f735466cecf";

impl Browser {
    fn new() -> Option<Self> {
        let found = |program: &str| {
            Command::new(program)
                .arg("--version")
                .output()
                .is_ok_and(|out| out.status.success())
        };
        if !(found("chromedriver") && found("chromium")) {
            let required = std::env::var_os("REQUIRE_CHROMIUM").is_some_and(|value| value == "1");
            assert!(
                !required,
                "REQUIRE_CHROMIUM=1, but chromedriver or chromium is not installed"
            );
            eprintln!("skipped: chromedriver or chromium is not installed");
            return None;
        }
        let port = std::net::TcpListener::bind("127.0.0.1:0")
            .unwrap()
            .local_addr()
            .unwrap()
            .port();
        let (driver, _) = start(
            Command::new("chromedriver").arg(format!("--port={port}")),
            "was started successfully",
        );
        let agent = ureq::Agent::new_with_defaults();
        let folder = std::env::temp_dir().join(format!("panel-browser-{}-{port}", std::process::id()));
        let arguments = [
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--window-size=1280,1100",
            &format!("--user-data-dir={}", folder.join("profile").display()),
        ];
        let capabilities = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": { "binary": which("chromium"), "args": arguments },
            "goog:loggingPrefs": { "browser": "ALL" },
        } } });
        let base = format!("http://127.0.0.1:{port}/session");
        let mut answer = agent.post(&base).send_json(&capabilities).unwrap();
        let answer: Value = answer.body_mut().read_json().unwrap();
        let id = answer["value"]["sessionId"].as_str().unwrap().to_owned();
        Some(Self {
            _driver: driver,
            session: format!("{base}/{id}"),
            agent,
            folder,
        })
    }

    fn post(&self, path: &str, body: &Value) -> Value {
        let mut answer = self
            .agent
            .post(format!("{}/{path}", self.session))
            .send_json(body)
            .unwrap_or_else(|error| panic!("{path} {body}: {error}"));
        let answer: Value = answer.body_mut().read_json().unwrap();
        answer["value"].clone()
    }

    fn open(&self, url: &str) {
        self.post("url", &json!({ "url": url }));
    }

    /// The value of a JavaScript expression.
    fn value(&self, expression: &str) -> Value {
        self.post(
            "execute/sync",
            &json!({ "script": format!("return {expression}"), "args": [] }),
        )
    }

    fn find(&self, selector: &str) -> String {
        let found = self.post("element", &json!({ "using": "css selector", "value": selector }));
        found[ELEMENT].as_str().unwrap().to_owned()
    }

    /// A click as with a mouse: what is hidden or covered cannot be clicked.
    fn click(&self, selector: &str) {
        let element = self.find(selector);
        self.post(&format!("element/{element}/click"), &json!({}));
    }

    fn fill(&self, selector: &str, text: &str) {
        let element = self.find(selector);
        self.post(&format!("element/{element}/clear"), &json!({}));
        self.post(&format!("element/{element}/value"), &json!({ "text": text }));
    }

    /// Types over what a field holds, and Return: Ctrl+A, null (all keys up), the text, Return, as WebDriver codes its keys.
    fn type_over(&self, selector: &str, text: &str) {
        let element = self.find(selector);
        let keys = format!("\u{e009}a\u{e000}{text}\u{e007}");
        self.post(&format!("element/{element}/value"), &json!({ "text": keys }));
    }

    /// Waits until a JavaScript expression is true.
    fn until(&self, expression: &str) {
        let begun = Instant::now();
        while self.value(expression) != json!(true) {
            assert!(
                begun.elapsed() < Duration::from_secs(20),
                "never true: {expression}; note: {}",
                self.value("document.getElementById('note').textContent")
            );
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Clicks and takes what the page hands down.
    fn download(&self, selector: &str, name: &str) -> Vec<u8> {
        let parameters = json!({ "behavior": "allow", "downloadPath": self.folder });
        self.post(
            "goog/cdp/execute",
            &json!({ "cmd": "Browser.setDownloadBehavior", "params": parameters }),
        );
        self.click(selector);
        let (path, begun) = (self.folder.join(name), Instant::now());
        // It bears its name only once it is complete.
        while !path.exists() {
            assert!(begun.elapsed() < Duration::from_secs(20), "{name} never came");
            std::thread::sleep(Duration::from_millis(50));
        }
        std::fs::read(path).unwrap()
    }

    /// Fails when the page's console shows an error.
    fn console_is_clean(&self) {
        let log = self.post("se/log", &json!({ "type": "browser" }));
        let errors: Vec<_> = log
            .as_array()
            .unwrap()
            .iter()
            .filter(|entry| entry["level"] == "SEVERE")
            .collect();
        assert!(errors.is_empty(), "{errors:#?}");
    }

    fn picture(&self, name: &str) {
        let Some(folder) = std::env::var_os("PANEL_SCREENSHOTS") else {
            return;
        };
        let mut answer = self.agent.get(format!("{}/screenshot", self.session)).call().unwrap();
        let answer: Value = answer.body_mut().with_config().limit(20_000_000).read_json().unwrap();
        let octets = base64(answer["value"].as_str().unwrap());
        std::fs::write(PathBuf::from(folder).join(format!("{name}.png")), octets).unwrap();
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // ChromeDriver ends its browser with the session.
        let _ = self.agent.delete(&self.session).call();
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

fn which(program: &str) -> String {
    let found = Command::new("sh")
        .args(["-c", &format!("command -v {program}")])
        .output()
        .unwrap();
    String::from_utf8(found.stdout).unwrap().trim().to_owned()
}

fn base64(text: &str) -> Vec<u8> {
    let digit = |octet: u8| match octet {
        b'A'..=b'Z' => octet - b'A',
        b'a'..=b'z' => octet - b'a' + 26,
        b'0'..=b'9' => octet - b'0' + 52,
        b'+' => 62,
        _ => 63,
    };
    let digits: Vec<u32> = text
        .bytes()
        .filter(|octet| *octet != b'=')
        .map(|octet| u32::from(digit(octet)))
        .collect();
    let mut octets = Vec::with_capacity(digits.len() * 3 / 4);
    for part in digits.chunks(4) {
        let bits = part
            .iter()
            .enumerate()
            .fold(0, |bits, (n, digit)| bits | digit << (18 - 6 * n));
        octets.extend(bits.to_be_bytes()[1..part.len()].iter());
    }
    octets
}

fn panel() -> (Process, String) {
    let (process, line) = start(
        Command::new(env!("CARGO_BIN_EXE_film-feed")).args(["panel", "--listen", "127.0.0.1:0"]),
        "panel at",
    );
    let url = line.split_whitespace().find(|word| word.starts_with("http")).unwrap();
    (process, url.trim_end_matches(';').to_owned())
}

#[test]
fn a_person_starts_feeds_breaks_the_cable_reads_the_fault_resets_changes_a_code_and_exports() {
    let Some(browser) = Browser::new() else { return };
    let (_panel, url) = panel();
    browser.open(&url);
    browser.until("document.querySelectorAll('[role=tab]').length === 6");
    browser.until("Number(document.body.dataset.frames) > 5");

    // A feed by length.
    browser.click("[data-word=enable]");
    browser.until("document.getElementById('out-drive_ready').textContent === '1'");
    browser.click("#factor");
    browser.click("#factor option[value='10']");
    std::thread::sleep(Duration::from_millis(300));
    browser.click("#start");
    browser.until("document.querySelectorAll('#feeds tbody tr').length === 1");
    // Thesis: ±0.01 mm.
    let error_um = browser.value("Number(document.querySelector('#feeds tbody td:nth-child(3)').textContent)");
    assert!(error_um.as_f64().unwrap().abs() <= 10.0, "{error_um}");
    // To the print mark.
    browser.click("[data-word=to_mark]");
    std::thread::sleep(Duration::from_millis(300));
    browser.click("#start");
    browser.until("document.querySelectorAll('#feeds tbody tr').length === 2");
    browser.picture("machine");
    // One mark is white from now on, all others stay black.
    browser.click("#blank-mark");
    browser.until("document.querySelectorAll('#machine svg rect[fill=\"#ffffff\"]').length === 1");
    // Nothing is wrong with these values; above 40.8 % the film would run back to its mark (9300 fact sheet, section 9.1).
    browser.until("document.getElementById('warnings').textContent.startsWith('Nothing goes wrong')");
    browser.click("#tab-variables");
    browser.type_over("#in-mark_velocity", "60");
    browser.click("#tab-machine");
    browser.until("document.getElementById('warnings').textContent.includes('reversal')");
    browser.click("#tab-variables");
    browser.type_over("#in-mark_velocity", "20");
    browser.click("#tab-machine");
    browser.until("document.getElementById('warnings').textContent.startsWith('Nothing goes wrong')");

    // The curve of a feed.
    browser.click("#tab-scope");
    browser.click("#factor option[value='1']");
    browser.click("#figure73");
    browser.until("document.querySelector('[data-word=hold]').getAttribute('aria-pressed') === 'true'");
    assert_eq!(browser.value("window.samplesLost"), json!(0));
    browser.picture("scope");
    let exported = String::from_utf8(browser.download("#csv", "scope.csv")).unwrap();
    assert!(
        exported.starts_with("time_s,POS-NOUT %,MCTRL-NACT %\n"),
        "{}",
        &exported[..60]
    );
    let peak = exported
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(1)?.parse::<f64>().ok())
        .fold(0.0, f64::max);
    // 2814.5 of 3000 rpm: 93.8 % (film-feed specification, section 5).
    assert!((peak - 93.8).abs() < 0.2, "{peak}");
    let svg = String::from_utf8(browser.download("#svg", "scope.svg")).unwrap();
    for part in ["<svg ", "POS-NOUT", "MCTRL-NACT", "Time in s", ">%</text>"] {
        assert!(svg.contains(part), "{part}");
    }
    // ISO/IEC 15948 5.2: the signature.
    assert!(browser.download("#png", "scope.png").starts_with(b"\x89PNG\r\n\x1A\n"));
    // Closer, along, and back again; the readings of the cursors follow.
    let distance = "Number(document.querySelector('#scope tbody td:nth-child(4)').textContent)";
    let wide = browser.value(distance).as_f64().unwrap();
    browser.click("#zoom-in");
    let close = browser.value(distance).as_f64().unwrap();
    assert!((close - wide / 2.0).abs() < 0.01, "{wide} {close}");
    browser.click("#zoom-all");
    assert_eq!(browser.value(distance).as_f64().unwrap(), wide);

    // The cable.
    browser.click("#tab-bus");
    browser.until("document.getElementById('slave').textContent === 'data exchange'");
    // Who is there: the module, and the PLC's master at address 2 (film-feed specification, section 1).
    browser.click("#ask-all");
    browser.until("document.querySelectorAll('#stations tbody tr').length === 2");
    assert_eq!(
        browser.value("document.querySelector('#stations tbody').innerText"),
        json!("2\tmaster in the ring\n3\tslave")
    );
    // A second master comes and goes; the feeds do not mind.
    browser.click("#second-master");
    browser.until("document.querySelector('#bus table.mono').textContent.includes('2 → 1')");
    browser.picture("bus");
    browser.click("#second-master");
    browser.click("#unplug");
    browser.until("document.getElementById('slave').textContent !== 'data exchange'");
    browser.click("#unplug");
    browser.until("document.getElementById('slave').textContent === 'data exchange'");

    // A fault, its remedy, its reset.
    browser.click("#tab-drive");
    browser.click("[data-word=cause]");
    browser.until("document.getElementById('fault').textContent.startsWith('12 OC2')");
    browser.until("document.getElementById('remedy').textContent.length > 10");
    // Transition 15 (profile, table of transitions).
    browser.until("document.getElementById('leads').textContent.includes('the cause of the fault is still there')");
    browser.picture("drive");
    browser.click("[data-word=clear]");
    browser.click("#reset");
    browser.until("document.getElementById('fault').textContent === 'none'");

    // A code.
    browser.fill("#code-name", "C1301/40");
    browser.fill("#code-value", "987.5");
    browser.click("#code-write");
    browser.until("document.getElementById('code-shown').textContent.startsWith('C1301/40 = 987.5000 units')");

    browser.click("#tab-variables");
    browser.picture("variables");
    browser.click("#tab-parameters");
    browser.until("document.querySelectorAll('#parameters svg circle[visibility=visible]').length > 0");
    browser.picture("parameters");

    // German.
    browser.click("#language");
    browser.click("#language option[value=de]");
    browser.until("document.getElementById('tab-scope').textContent === 'Oszilloskop'");
    browser.click("#tab-drive");
    browser.until(
        "[...document.querySelectorAll('#drive svg text')].some((text) => text.textContent === 'Betrieb freigegeben')",
    );
    assert_eq!(browser.value("window.framesLost"), json!(0));
    browser.console_is_clean();
}

/// What a person without mouse or sight needs, in every view: each control has a name, texts have contrast, nothing is out of order.
const AUDIT: &str = r#"(() => {
  const problems = [];
  const name = (e) => (e.getAttribute("aria-label") || (e.getAttribute("aria-labelledby") && document.getElementById(e.getAttribute("aria-labelledby"))?.textContent)
    || (e.labels && [...e.labels].map((l) => l.textContent).join(" ")) || e.textContent || "").trim();
  const seen = (e) => e.getClientRects().length > 0;
  for (const e of document.querySelectorAll("button, select, input, [role=img], [role=region], [tabindex='0']")) {
    if (seen(e) && !name(e)) problems.push(`no name: ${e.outerHTML.slice(0, 90)}`);
  }
  for (const e of document.querySelectorAll("[tabindex]")) if (e.tabIndex > 0) problems.push(`tabindex above 0: ${e.outerHTML.slice(0, 90)}`);
  const ids = [...document.querySelectorAll("[id]")].map((e) => e.id);
  for (const id of ids) if (ids.filter((other) => other === id).length > 1) problems.push(`id twice: ${id}`);
  for (const e of document.querySelectorAll("th")) if (!e.scope) problems.push(`th without scope: ${e.textContent}`);
  if (!document.documentElement.lang || !document.title) problems.push("no language or title");
  const rgb = (text) => (text.match(/[\d.]+/g) || []).map(Number);
  const luminance = ([r, g, b]) => [r, g, b].map((v) => v / 255).map((v) => (v <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4)).reduce((sum, v, n) => sum + v * [0.2126, 0.7152, 0.0722][n], 0);
  const ground = (e) => { for (; e; e = e.parentElement) { const c = rgb(getComputedStyle(e).backgroundColor); if (c.length === 3 || c[3] > 0) return c; } return [255, 255, 255]; };
  for (const e of document.querySelectorAll("body *")) {
    const text = [...e.childNodes].some((n) => n.nodeType === 3 && n.textContent.trim());
    if (!text || !seen(e) || e.closest("svg")) continue;
    const [a, b] = [luminance(rgb(getComputedStyle(e).color)), luminance(ground(e))];
    const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
    if (contrast < 4.5) problems.push(`contrast ${contrast.toFixed(2)}: ${e.outerHTML.slice(0, 90)}`);
  }
  return problems;
})()"#;

#[test]
fn every_view_has_names_contrast_and_an_order_for_the_keyboard() {
    let Some(browser) = Browser::new() else { return };
    let (_panel, url) = panel();
    browser.open(&url);
    browser.until("document.querySelectorAll('[role=tab]').length === 6");
    browser.until("Number(document.body.dataset.frames) > 5");
    for view in ["machine", "variables", "scope", "drive", "parameters", "bus"] {
        browser.click(&format!("#tab-{view}"));
        std::thread::sleep(Duration::from_millis(150));
        // WCAG 2.1: 1.1.1, 1.3.1, 1.4.3 (4.5 : 1), 2.4.2, 2.4.3, 3.1.1, 4.1.2.
        let problems = browser.value(AUDIT);
        assert_eq!(problems, json!([]), "{view}");
    }
    // Views are reached by the arrow keys, as tabs are.
    browser.value("document.getElementById('tab-bus').focus()");
    browser.value(
        "document.activeElement.dispatchEvent(new KeyboardEvent('keydown', { key: 'ArrowLeft', bubbles: true }))",
    );
    assert_eq!(browser.value("document.activeElement.id"), json!("tab-parameters"));
    assert_eq!(
        browser.value("document.getElementById('parameters').hidden"),
        json!(false)
    );
    browser.console_is_clean();
}
