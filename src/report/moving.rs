//! A moving picture of a run: one SVG that plays wherever a browser shows an image, without a script.

use super::arrows::{Arrow, Paths, STATUSES, crowd, keys, longest, paths, widths};
use super::markup::{escaped, six_digits};
use super::moving_frames::Frame;
use super::palette::INK;
use super::replay::steps;
use super::sheet::Sheet;
use super::stage::{LANES, Pose, Stage, View};
use super::still_bodies::{Drawn, KINDS, Map, draw_body, drawn, hex, mark_radius, path};
use super::table::number;
use super::{OutputFolder, ReportError};
use std::fmt::Write;

/// Most bytes of the picture, so that a page that shows it loads fast.
const BUDGET: usize = 480_000;
/// Most frames; a browser moves the bodies on straight ways between them.
const MOST_FRAMES: usize = 150;
/// Least frames for which there must be room.
const LEAST_FRAMES: usize = 8;
/// Most arrows of a frame, the largest, and least if fewer make the motion smooth.
const MOST_ARROWS: usize = 300;
const LEAST_ARROWS: usize = 40;
/// With fewer frames, arrows make way before frames do.
const SMOOTH_FRAMES: usize = 75;
/// Bytes at most: of an arrow, of a body and of a joint in a frame, and of a body beside its outline.
const ARROW_BYTES: usize = 75;
const BODY_BYTES: usize = 24;
const LINK_BYTES: usize = 90;
const MOTION_BYTES: usize = 260;
/// How long the motion plays \[s\]: as long as it takes, within these limits.
const PLAYED: [f64; 2] = [3.0, 10.0];
/// How long the end stays \[s\].
const HOLD: f64 = 1.0;
/// Corners of a spring, the same in each frame.
const TURNS: usize = 10;
/// Arrows are cut at so many times the length of a usual large one.
const CUT: f64 = 2.0;

/// What is to be animated.
pub struct Moving<'a> {
    pub stage: &'a Stage,
    /// One line.
    pub title: &'a str,
    /// More to know about the picture.
    pub note: Option<&'a str>,
}

/// What of a run is drawn.
struct Kept<'a> {
    frames: Vec<&'a Frame>,
    /// Written steps of which one is a frame.
    stride: usize,
    /// Most arrows of a frame.
    arrows: usize,
}

impl Kept<'_> {
    fn arrows(&self, frame: &'_ Frame) -> usize {
        frame.arrows.len().min(self.arrows)
    }
}

/// The lists of one animation: how long it takes with the end held, and how often the end is repeated.
struct Clock {
    played: f64,
    total: f64,
    held: usize,
    frames: usize,
}

impl Clock {
    fn new(frames: &[&Frame]) -> Clock {
        let time = frames.last().map_or(0.0, |frame| frame.time);
        let played = time.clamp(PLAYED[0], PLAYED[1]);
        let between = played / (frames.len().max(2) - 1) as f64;
        let held = (HOLD / between).ceil() as usize;
        Clock {
            played,
            total: played + held as f64 * between,
            held,
            frames: frames.len(),
        }
    }

    /// Attributes of an animation through a value for each frame.
    fn through(&self, values: &[String]) -> String {
        let last = values.last().map_or("", String::as_str);
        let values = values.join(";") + &format!(";{last}").repeat(self.held);
        format!("values=\"{values}\" {}", self.repeated())
    }

    fn repeated(&self) -> String {
        format!(
            "dur=\"{}s\" repeatCount=\"indefinite\"",
            short(self.total, 3)
        )
    }

    /// An animation that shows its element during frame `k` alone.
    fn only(&self, k: usize) -> String {
        let at = |k: usize| short(k as f64 / (self.frames - 1 + self.held) as f64, 5);
        let (values, times) = match (k, k + 1 == self.frames) {
            (_, true) => ("none;inline", format!("0;{}", at(k))),
            (0, _) => ("inline;none", format!("0;{}", at(1))),
            _ => ("none;inline;none", format!("0;{};{}", at(k), at(k + 1))),
        };
        format!(
            "<animate attributeName=\"display\" calcMode=\"discrete\" values=\"{values}\" keyTimes=\"{times}\" {}/>",
            self.repeated()
        )
    }
}

impl Moving<'_> {
    /// Why a scene cannot be animated within the size of a picture; `None` if it can.
    pub fn refused(stage: &Stage) -> Option<String> {
        let map = around_origin(1.0);
        let mut outlines = String::new();
        for body in &stage.bodies {
            draw_body(&mut outlines, &map, body, [0.0; 3]);
        }
        let moving = stage
            .bodies
            .iter()
            .filter(|body| body.kind != "fixed")
            .count();
        let links = stage.links.len();
        let frame = LEAST_ARROWS * ARROW_BYTES + BODY_BYTES * moving + LINK_BYTES * links;
        let least = outlines.len() + MOTION_BYTES * moving + LEAST_FRAMES * frame;
        (least > BUDGET).then(|| {
            format!(
                "{moving} bodies that move and {links} joints need {} kB for {LEAST_FRAMES} frames, and a moving \
                 picture has at most {} kB",
                least / 1000,
                BUDGET / 1000
            )
        })
    }

    /// The picture as an SVG document, from the files of a run that are written and not yet committed; the
    /// same bytes for the same files. Its frames are the start and one written step in several, evenly
    /// spaced, as many as there is room for.
    ///
    /// # Errors
    /// `ReportError::Io` and `ReportError::Csv`.
    pub fn to_svg(&self, folder: &OutputFolder) -> Result<String, ReportError> {
        let mut steps = steps(folder)?;
        if let [[first, _], [second, _], .., [before, _], [last, _]] = steps[..]
            && last - before < 0.99 * (second - first)
        {
            // the last step of a run, sooner after the row before than any other
            steps.pop();
        }
        let stride = steps.len().div_ceil(MOST_FRAMES - 1).max(1);
        let mut frames = Frame::read(self.stage, folder, &steps, stride)?;
        for frame in &mut frames {
            frame.arrows.sort_by(|a, b| b.size().total_cmp(&a.size()));
        }
        // frames are kept at even distances, so that the motion is even
        let (mut thinning, mut arrows) = (1, MOST_ARROWS);
        loop {
            let kept = Kept {
                frames: frames.iter().step_by(thinning).collect(),
                stride: stride * thinning,
                arrows,
            };
            let svg = self.drawn(&kept);
            let count = kept.frames.len();
            if svg.len() <= BUDGET || count <= LEAST_FRAMES {
                return Ok(svg);
            }
            match count <= SMOOTH_FRAMES && arrows > LEAST_ARROWS {
                true => arrows = arrows * 3 / 4,
                false => thinning += 1,
            }
        }
    }

    fn drawn(&self, kept: &Kept) -> String {
        let frames = &kept.frames;
        let views = frames.iter().map(|frame| frame.poses.as_slice());
        let sheet = Sheet::of(View::of(self.stage, views));
        let clock = Clock::new(frames);
        let shown = |frame: &&'_ Frame| frame.arrows[..kept.arrows(frame)].to_vec();
        let all: Vec<Arrow> = frames.iter().flat_map(shown).collect();
        let usual = usual(&all);
        let most = frames.iter().map(|f| kept.arrows(f)).max().unwrap_or(0);
        let crowd = crowd(most);
        let mut lines = Vec::new();
        if self.stage.lane > 0.0 {
            lines.push(LANES.to_owned());
        } else if usual > 0.0 {
            let left_out = frames.iter().any(|f| f.arrows.len() > kept.arrows);
            let largest = if left_out {
                format!(", the {} largest of a frame", kept.arrows)
            } else {
                String::new()
            };
            lines.push(format!(
                "arrows: impulses of the shown steps and the impacts between them{largest}; nine in ten are below {} N s",
                number(usual, 3)
            ));
            lines.push(keys(&all));
        }
        lines.extend(self.note.map(escaped));
        let mut svg = sheet.open(
            self.title,
            &played(frames, &clock, kept.stride),
            lines.len(),
        );
        svg.push_str(&style(crowd));
        for kind in KINDS {
            for (k, body) in self.stage.bodies.iter().enumerate() {
                if body.kind == kind {
                    self.add_body(&mut svg, &sheet.map, k, frames, &clock);
                }
            }
        }
        self.add_links(&mut svg, &sheet.map, frames, &clock);
        let longest = longest(sheet.wide, sheet.high, crowd);
        let length = |size: f64| longest * (size / usual).min(CUT);
        for (k, frame) in frames.iter().enumerate() {
            // what does not animate shows the end
            let hidden = if k + 1 == frames.len() {
                ""
            } else {
                " display=\"none\""
            };
            let _ = write!(svg, "<g{hidden}>{}", clock.only(k));
            let shown = &frame.arrows[..kept.arrows(frame)];
            for (s, paths) in paths(&sheet.map, shown, length).iter().enumerate() {
                let Paths {
                    dots,
                    shafts,
                    heads,
                } = paths;
                for (class, d) in [("d", dots), ("a", shafts), ("h", heads)] {
                    if !d.is_empty() {
                        let _ = write!(svg, "<path class=\"{class}{s}\" d=\"{d}\"/>");
                    }
                }
            }
            let _ = writeln!(
                svg,
                "<text x=\"8\" y=\"18\" stroke=\"#fff\" stroke-width=\"3\" paint-order=\"stroke\">t = {} s</text></g>",
                six_digits(frame.time)
            );
        }
        let share = short(clock.played / clock.total, 5);
        let _ = writeln!(
            svg,
            "<rect y=\"{:.1}\" width=\"{w:.1}\" height=\"3\" fill=\"#8a9aa5\"><animate attributeName=\"width\" \
             values=\"0;{w:.1};{w:.1}\" keyTimes=\"0;{share};1\" {}/></rect>",
            sheet.high - 3.0,
            clock.repeated(),
            w = sheet.wide,
        );
        sheet.close(&mut svg, self.stage.unit(), &lines);
        svg
    }

    /// A body, with its motion if it has any.
    fn add_body(&self, svg: &mut String, map: &Map, k: usize, frames: &[&Frame], clock: &Clock) {
        let body = &self.stage.bodies[k];
        let poses = frames.iter().filter_map(|f| f.poses.get(k));
        let poses: Vec<Pose> = poses.map(|pose| self.stage.place(k, *pose)).collect();
        let Some((first, end)) = poses.first().zip(poses.last()) else {
            return;
        };
        if poses.iter().all(|pose| pose == first) {
            return draw_body(svg, map, body, *first);
        }
        // a turn moves the rim of a large body far
        let reach = body
            .pieces
            .iter()
            .map(|piece| piece.reach())
            .fold(0.0, f64::max);
        let digits = if map.scale * reach > 60.0 { 2 } else { 1 };
        let place = |pose: &Pose| {
            let [x, y] = map.px([pose[0], pose[1]]);
            format!("{} {}", short(x, 1), short(y, 1))
        };
        let turn = |pose: &Pose| short(-pose[2].to_degrees(), digits);
        let _ = write!(
            svg,
            "<g transform=\"translate({})rotate({})\">",
            place(end),
            turn(end)
        );
        let motion = |kind: &str, values: Vec<String>| {
            let through = clock.through(&values);
            format!("<animateTransform attributeName=\"transform\" {kind} {through}/>")
        };
        svg.push_str(&motion(
            "type=\"translate\"",
            poses.iter().map(place).collect(),
        ));
        let turns = poses.iter().map(turn).collect();
        svg.push_str(&motion("type=\"rotate\" additive=\"sum\"", turns));
        draw_body(svg, &around_origin(map.scale), body, [0.0; 3]);
        svg.push_str("</g>\n");
    }

    /// All joints: arms, lines and marks, a path of each.
    fn add_links(&self, svg: &mut String, map: &Map, frames: &[&Frame], clock: &Clock) {
        let mut data: [Vec<String>; 3] = Default::default();
        for frame in frames {
            let mut of_frame: [String; 3] = Default::default();
            for link in &self.stage.links {
                let Drawn { arms, lines, marks } = drawn(link, map, &frame.poses, Some(TURNS));
                arms.iter().for_each(|arm| of_frame[0].push_str(&path(arm)));
                lines
                    .iter()
                    .for_each(|line| of_frame[1].push_str(&path(line)));
                for [x, y] in marks {
                    let _ = write!(of_frame[2], "M{x:.1} {y:.1}h0");
                }
            }
            for (all, one) in data.iter_mut().zip(of_frame) {
                all.push(one);
            }
        }
        let mark = format!(
            "stroke=\"{}\" stroke-width=\"{}\" stroke-linecap=\"round\"",
            hex(INK),
            2.0 * mark_radius(self.stage)
        );
        let looks = [
            "stroke=\"#8a9aa5\"",
            "stroke=\"#262626\" stroke-width=\"1.2\"",
            &mark,
        ];
        for (data, look) in data.iter().zip(looks) {
            let Some(end) = data.last().filter(|d| !d.is_empty()) else {
                continue;
            };
            let _ = write!(svg, "<path fill=\"none\" {look} d=\"{end}\">");
            if data.iter().any(|d| d != end) {
                let _ = write!(
                    svg,
                    "<animate attributeName=\"d\" {}/>",
                    clock.through(data)
                );
            }
            svg.push_str("</path>\n");
        }
    }
}

/// A map for the outlines of bodies, which their motion then places.
fn around_origin(scale: f64) -> Map {
    let view = View {
        x: [0.0; 2],
        y: [0.0; 2],
    };
    Map { view, scale }
}

/// The impulse that nine in ten stay below \[N s\]; 0 without any.
fn usual(arrows: &[Arrow]) -> f64 {
    let mut sizes: Vec<f64> = arrows.iter().map(Arrow::size).collect();
    sizes.sort_by(f64::total_cmp);
    sizes
        .get(sizes.len().saturating_sub(1) * 9 / 10)
        .copied()
        .unwrap_or(0.0)
}

/// What is played, and how fast.
fn played(frames: &[&Frame], clock: &Clock, stride: usize) -> String {
    let time = frames.last().map_or(0.0, |frame| frame.time);
    let speed = match time / clock.played {
        share if (share - 1.0).abs() < 0.005 => "at its own speed".to_owned(),
        share if share < 1.0 => format!("{} times slower", number(1.0 / share, 2)),
        share => format!("{} times faster", number(share, 2)),
    };
    let steps = match stride {
        1 => "every written step".to_owned(),
        n => format!("one written step in {n}"),
    };
    format!("{} s, {speed}; {steps} is shown", six_digits(time))
}

/// Looks of dots, shafts and heads of each status.
fn style(crowd: f64) -> String {
    let [dot, shaft] = widths(crowd);
    let mut style = String::from("<style>");
    for (s, (colour, _)) in STATUSES.iter().enumerate() {
        let colour = hex(*colour);
        let _ = write!(
            style,
            ".d{s}{{stroke:{colour};stroke-width:{dot:.1};stroke-linecap:round}}\
             .a{s}{{stroke:{colour};stroke-width:{shaft:.1}}}.h{s}{{fill:{colour}}}"
        );
    }
    style + "</style>\n"
}

/// `value` with so many digits after the point, without zeros at its end.
fn short(value: f64, digits: usize) -> String {
    let text = format!("{value:.digits$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    match text {
        "-0" => "0".to_owned(),
        text => text.to_owned(),
    }
}
