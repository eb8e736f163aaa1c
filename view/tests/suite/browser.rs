//! Pages as Chromium shows them; without Chromium these tests say that they skip.

use super::page::{data, written};
use super::robots::{arm, hostile};
use std::net::TcpListener;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_core::model::Model;
use straightline_view::ViewedRun;

/// Colour of the picture's background in the light and in the dark.
const STAGE: [[u8; 3]; 2] = [[0xee, 0xf2, 0xf7], [0x17, 0x1e, 0x27]];

/// What a browser made of a page.
struct Seen {
    document: String,
    /// What was said on the console, and whatever else is logged.
    log: String,
    width: usize,
    height: usize,
    /// Red, green, blue of each pixel, line by line.
    pixels: Vec<[u8; 3]>,
}

fn chromium() -> Option<PathBuf> {
    let folders = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    std::env::split_paths(&folders).flat_map(|folder| names.map(|name| folder.join(name))).find(|path| path.is_file())
}

/// Opens a page at this fragment, with further arguments of the browser; `None` where there is no browser.
fn seen(name: &str, page: &str, fragment: &str, is_dark: bool, more: &[&str]) -> Option<Seen> {
    let Some(browser) = chromium() else {
        eprintln!("skipped: Chromium is not installed");
        return None;
    };
    let here = Path::new(env!("CARGO_TARGET_TMPDIR")).join("view").join(name);
    std::fs::create_dir_all(&here).unwrap();
    let (file, picture) = (here.join("page.html"), here.join("page.png"));
    std::fs::write(&file, page).unwrap();
    let _ = std::fs::remove_file(&picture);
    let output = Command::new(browser)
        .args([
            "--headless=new",
            "--no-sandbox",
            "--use-gl=angle",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
        ])
        .args(["--hide-scrollbars", "--window-size=1200,800", "--virtual-time-budget=1500", "--enable-logging=stderr"])
        .args([
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-extensions",
        ])
        .args(more)
        .arg(format!("--blink-settings=preferredColorScheme={}", if is_dark { 0 } else { 1 }))
        .arg(format!("--user-data-dir={}", here.join("profile").display()))
        .arg(format!("--screenshot={}", picture.display()))
        .arg("--dump-dom")
        .arg(format!("file://{}#{fragment}", file.display()))
        .output()
        .expect("the browser starts");
    let decoder =
        png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&picture).expect("there is a picture")));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks(info.color_type.samples()).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect();
    Some(Seen {
        document: String::from_utf8(output.stdout).unwrap(),
        log: String::from_utf8_lossy(&output.stderr).to_string(),
        width: info.width as usize,
        height: info.height as usize,
        pixels,
    })
}

impl Seen {
    fn pixel(&self, x: f64, y: f64) -> [i32; 3] {
        self.pixels[y as usize * self.width + x as usize].map(i32::from)
    }

    /// The corners of the picture, which is where its background is seen: left, top, right, bottom.
    fn stage(&self, colour: [u8; 3]) -> [usize; 4] {
        let places = (0..self.pixels.len()).filter(|k| self.pixels[*k] == colour);
        places.fold([self.width, self.height, 0, 0], |[left, top, right, bottom], k| {
            let (x, y) = (k % self.width, k / self.width);
            [left.min(x), top.min(y), right.max(x + 1), bottom.max(y + 1)]
        })
    }

    /// An attribute of the picture.
    fn attribute(&self, name: &str) -> Option<&str> {
        let canvas = self.document.split("<canvas").nth(1)?.split('>').next()?;
        canvas.split(&format!("data-{name}=\"")).nth(1)?.split('"').next()
    }

    fn assert_nothing_is_wrong(&self) {
        assert_eq!(self.attribute("problem"), None);
        let vertices: u32 = self.attribute("vertices").expect("the page has drawn").parse().unwrap();
        assert!(vertices > 3_000, "{vertices}");
        let said: Vec<&str> = self.log.lines().filter(|line| line.contains("CONSOLE")).collect();
        assert!(said.is_empty(), "{said:?}");
    }
}

fn numbers(of: &serde_json::Value) -> Vec<f64> {
    of.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

/// Where a point of the world is seen in a picture of these corners, by the page's camera: written anew, from the definition of a pinhole.
fn projected(page: &str, point: [f64; 3], [left, top, right, bottom]: [usize; 4]) -> [f64; 2] {
    let camera = &data(page)["camera"];
    let number = |name: &str| camera[name].as_f64().unwrap();
    let axes: Vec<Vec<f64>> = camera["axes"].as_array().unwrap().iter().map(numbers).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (azimuth, elevation) = (number("azimuth"), number("elevation"));
    // in the camera's own directions: to the right, up, and away from it
    let along = |a: f64, b: f64, c: f64| -> Vec<f64> {
        (0..3).map(|k| a * axes[0][k] + b * axes[1][k] + c * axes[2][k]).collect()
    };
    let right_of = along(-azimuth.sin(), azimuth.cos(), 0.0);
    let up_of = along(-elevation.sin() * azimuth.cos(), -elevation.sin() * azimuth.sin(), elevation.cos());
    let away = along(-elevation.cos() * azimuth.cos(), -elevation.cos() * azimuth.sin(), -elevation.sin());
    let from_target: Vec<f64> = point.iter().zip(numbers(&camera["target"])).map(|(p, t)| p - t).collect();
    let depth = number("distance") + dot(&away, &from_target);
    let (width, height) = ((right - left) as f64, (bottom - top) as f64);
    assert!(width > height, "the angle is that between top and bottom");
    let focus = height / 2.0 / (number("field_of_view") / 2.0).tan();
    let (x, y) = (dot(&right_of, &from_target), dot(&up_of, &from_target));
    [left as f64 + width / 2.0 + focus * x / depth, top as f64 + height / 2.0 - focus * y / depth]
}

/// Origins of the joints of a robot where its run begins, and in front of them the middle of the capsule from one to the next.
fn origins(model: &Model<f64>, run: &ViewedRun) -> Vec<[f64; 3]> {
    straightline_view::world_poses(model, &run.configurations[0]).iter().map(|pose| pose.position).collect()
}

#[test]
fn the_first_pose_is_drawn_where_a_pinhole_camera_sees_it() {
    let model = arm();
    let run = ViewedRun::tour(&model);
    let page = written(&model, &run);
    let Some(seen) = seen("arm", &page, "t=0&show=capsules", false, &[]) else { return };
    seen.assert_nothing_is_wrong();
    assert_eq!(seen.attribute("time"), Some("0"));
    let stage = seen.stage(STAGE[0]);
    assert!(stage[2] - stage[0] > 500 && stage[3] - stage[1] > 300, "{stage:?}");
    let joints = origins(&model, &run);
    let [[x0, y0], [x1, y1]] = [joints[1], joints[2]].map(|origin| projected(&page, origin, stage));
    assert!((x1 - x0).hypot(y1 - y0) > 60.0, "the upper arm is long enough to be looked at");
    // the shoulder is orange, the ball of the hand red, the capsule between shoulder and slide neither
    let [red, green, blue] = seen.pixel(x0, y0);
    assert!(red > blue + 60 && red > green + 20, "shoulder: {:?}", seen.pixel(x0, y0));
    let [x, y] = projected(&page, joints[3], stage);
    let [red, green, blue] = seen.pixel(x, y);
    assert!(red > blue + 60 && red > green + 60, "hand: {:?}", seen.pixel(x, y));
    let (x, y) = (0.5 * (x0 + x1), 0.5 * (y0 + y1));
    let pixel = seen.pixel(x, y);
    let spread = pixel.iter().max().unwrap() - pixel.iter().min().unwrap();
    assert!(spread < 60 && pixel[0] < 225, "upper arm: {pixel:?}");
    // beside it there is nothing
    let (across, length) = ([y0 - y1, x1 - x0], (x1 - x0).hypot(y1 - y0));
    for side in [-50.0, 50.0] {
        let beside = seen.pixel(x + side * across[0] / length, y + side * across[1] / length);
        assert_eq!(beside, STAGE[0].map(i32::from), "{side} pixels beside the upper arm");
    }
}

#[test]
fn hostile_names_are_text_and_nothing_leaves_the_page() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    listener.set_nonblocking(true).unwrap();
    let mut model = hostile();
    let address = listener.local_addr().unwrap();
    model.bodies[2].name = format!("</script><img src=//{address}/name><script>fetch('//{address}/script')</script>");
    let page = written(&model, &ViewedRun::tour(&model));
    let Some(seen) = seen("hostile", &page, "t=0.3&show=capsules,ellipsoids,frames,names,ground", true, &[]) else {
        return;
    };
    seen.assert_nothing_is_wrong();
    assert!(listener.accept().is_err(), "the page has asked for something");
    // as text of elements, and nowhere as elements
    let text = model.bodies[2].name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;");
    assert!(seen.document.contains(&format!(">{text}</bdi>")), "the name is a label");
    assert!(seen.document.contains("&lt;/title&gt;&lt;img src=x onerror=alert(2)&gt;</h1>"));
    assert!(!seen.document.contains("<img") && seen.document.matches("<script").count() == 2);
    // it is dark
    let stage = seen.stage(STAGE[1]);
    assert!(stage[2] > stage[0] + 500 && stage[3] > stage[1] + 300, "{stage:?}");
}

#[test]
fn without_webgl_the_page_says_so_and_shows_its_plots() {
    let model = arm();
    let page = written(&model, &ViewedRun::tour(&model));
    let Some(seen) = seen("plain", &page, "t=0.5", false, &["--disable-3d-apis"]) else { return };
    assert!(
        seen.attribute("problem").is_some_and(|problem| problem.contains("no WebGL2")),
        "{:?}",
        seen.attribute("problem")
    );
    assert_eq!(seen.attribute("vertices"), None);
    // two plots are open, the one of the quaternion is not
    assert_eq!(seen.document.matches("class=\"cursor\"").count(), 2);
    assert!(seen.document.contains("0.500 s</output>"));
}

/// What a script that is added to a page, which stands at 0.5 s, sees after its gestures: it writes into the page's title.
fn told(name: &str, fragment: &str, script: &str) -> Option<String> {
    let model = arm();
    let page = written(&model, &ViewedRun::tour(&model));
    // no script but its own would run
    let page = page.replace("http-equiv=\"Content-Security-Policy\"", "name=\"policy\"");
    // once the page shows the time that it is asked for
    let shown = "document.getElementById('clock').textContent.startsWith('0.500')";
    let wait = format!("const go = () => {{ if (!{shown}) return setTimeout(go, 20); {script} }}; go();");
    let page = format!("{page}<script>{{ {wait} }}</script>");
    // a browser on a busy machine may end before it has drawn anything
    for _ in 0..3 {
        let seen = seen(name, &page, fragment, false, &["--disable-3d-apis"])?;
        let title = seen.document.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next());
        let title = title.expect("a page has a title");
        if !title.ends_with(": in motion") {
            return Some(title.to_string());
        }
    }
    panic!("the page never stood at 0.5 s");
}

/// The span that plots say they show, and the numbers at the first plot's time axis.
const SPAN: &str = "const plot = document.querySelector('.chart > svg');
    const box = plot.getBoundingClientRect();
    const middle = { clientX: box.left + 52 + (box.width - 64) / 2, clientY: box.top + 60, bubbles: true, cancelable: true };
    const said = () => document.title = [...document.querySelectorAll('.chart[open] > svg')].map((svg) => svg.getAttribute('aria-label')).join(';');";

/// Seconds that every plot says it shows.
fn spans(title: &str) -> Vec<[f64; 2]> {
    let number = |text: &str| text.trim_end_matches(" s").replace('\u{2212}', "-").parse::<f64>().unwrap();
    title
        .split(';')
        .map(|label| {
            let (from, to) = label.split_once(", from ").expect(label).1.split_once(" to ").expect(label);
            [number(from), number(to)]
        })
        .collect()
}

#[test]
fn plots_are_zoomed_together_by_wheel_keys_and_the_pages_address() {
    let model = arm();
    let times = ViewedRun::tour(&model).times;
    let (first, last) = (times[0], times[times.len() - 1]);
    let close = |spans: Vec<[f64; 2]>, from: f64, to: f64| {
        assert_eq!(spans.len(), 2, "two plots are open");
        // a pointer's place is a whole pixel
        let pixel = 2e-3 * last;
        for [a, b] in spans {
            assert!((a - from).abs() < pixel && (b - to).abs() < pixel, "{a} {b} instead of {from} {to}");
        }
    };
    let address = format!("t=0.5&from={}&to={}", 0.25 * last, 0.75 * last);
    let Some(title) = told("zoom_address", &address, &format!("{SPAN} said()")) else { return };
    close(spans(&title), 0.25 * last, 0.75 * last);
    // with Ctrl, about the time under the pointer; without it the page scrolls
    let wheel = "plot.dispatchEvent(new WheelEvent('wheel', { ...middle, deltaY: -60 }));
        plot.dispatchEvent(new WheelEvent('wheel', { ...middle, deltaY: -60, ctrlKey: true }));";
    let half = 0.5 * (last - first) * (-0.3_f64).exp();
    let title = told("zoom_wheel", "t=0.5", &format!("{SPAN} {wheel} said()")).unwrap();
    close(spans(&title), 0.5 * (first + last) - half, 0.5 * (first + last) + half);
    let key =
        |name: &str| format!("plot.dispatchEvent(new KeyboardEvent('keydown', {{ key: '{name}', bubbles: true }}));");
    let keys = format!("{SPAN} {} {} said()", key("+"), key("ArrowRight"));
    let from = 0.5 - 0.8 * (0.5 - first);
    let size = 0.8 * (last - first);
    let title = told("zoom_keys", "t=0.5", &keys).unwrap();
    close(spans(&title), from + 0.1 * size, from + 1.1 * size);
    let all = format!("{SPAN} {} {} said()", key("+"), key("0"));
    let title = told("zoom_reset", "t=0.5", &all).unwrap();
    assert!(title.split(';').count() == 2 && !title.contains("from"), "{title}");
}

#[test]
fn a_span_of_a_plot_is_chosen_with_shift_and_a_line_of_many_rows_keeps_its_peaks() {
    let drag = "plot.setPointerCapture = () => {};
        const inner = box.width - 64;
        const event = (name, part, buttons) => plot.dispatchEvent(new PointerEvent(name, { pointerId: 1, buttons, shiftKey: true, ...middle, clientX: box.left + 52 + part * inner }));
        event('pointerdown', 0.2, 1); event('pointermove', 0.4, 1); event('pointerup', 0.4, 0);";
    let Some(title) = told("zoom_drag", "t=0.5", &format!("{SPAN} {drag} said()")) else { return };
    let last = *ViewedRun::tour(&arm()).times.last().unwrap();
    for [from, to] in spans(&title) {
        assert!((from - 0.2 * last).abs() < 0.01 * last && (to - 0.4 * last).abs() < 0.01 * last, "{from} {to}");
    }
    // two thousand rows in a hundred pixels, one of them a peak of each sign
    let peaks =
        "const values = Float32Array.from({ length: 2000 }, (_, k) => (k === 777 ? 5 : k === 1234 ? -7 : Math.sin(k)));
        const times = Float64Array.from(values, (_, k) => k);
        const d = path(times, values, [0, 1999], (t) => t / 20, (v) => v);
        const heights = d.slice(1).split('L').map((point) => Number(point.split(' ')[1]));
        document.title = [Math.max(...heights), Math.min(...heights), heights.length <= 400].join(' ');";
    assert_eq!(told("peaks", "t=0.5", peaks).unwrap(), "5 -7 true");
}
