//! One HTML page of a run: a file that needs no other and no network.

use super::ReportError;
use super::chart::Chart;
use super::markup::{escaped, in_script};
use super::panel::{Panel, inline};
use super::panels::size;
use super::replay::Replay;
use super::stage::Stage;
use std::fmt::Write;

const PAGE: &str = include_str!("page.html");
const REPLAY: &str = include_str!("replay.html");
const STYLE: &str = include_str!("page.css");
const SCRIPTS: [&str; 3] = [
    include_str!("data.js"),
    include_str!("draw.js"),
    include_str!("page.js"),
];

/// A picture is shown no smaller than this, so that its text stays legible, and is scrolled instead.
const SMALLEST: f64 = 0.68;

/// What a reader must know before the rest, a sentence each.
#[derive(Debug, Clone, PartialEq)]
pub struct Lead {
    /// Whether the results can be taken as they are.
    pub good: bool,
    pub what_came_out: String,
    pub can_it_be_trusted: String,
    pub what_to_do: String,
}

/// A part of a page below the replay.
#[derive(Debug, Clone)]
pub enum Section {
    /// Small charts that share the time cursor.
    Charts {
        title: String,
        charts: Vec<Chart>,
    },
    /// A cell `no` of a table is red.
    Table {
        title: String,
        header: Vec<String>,
        rows: Vec<Vec<String>>,
    },
    List {
        title: String,
        items: Vec<String>,
    },
    /// SVG documents of this program with a caption each.
    Pictures {
        title: String,
        pictures: Vec<(String, String)>,
    },
    /// Text as the terminal shows it.
    Text {
        title: String,
        text: String,
    },
}

/// A page. All texts may come from a user: they are escaped.
#[derive(Debug, Clone)]
pub struct Page<'a> {
    pub title: &'a str,
    pub lead: Lead,
    pub replay: Option<(&'a Stage, Replay)>,
    pub sections: Vec<Section>,
}

impl Page<'_> {
    /// The page as HTML, the same bytes for the same page.
    ///
    /// # Errors
    /// Those of [`Chart::to_svg`].
    pub fn to_html(&self) -> Result<String, ReportError> {
        let mut sections = String::new();
        for section in &self.sections {
            sections.push_str(&section_html(section)?);
        }
        let data = match &self.replay {
            Some((stage, replay)) => {
                let mut data = serde_json::to_value(replay).unwrap_or_default();
                data["stage"] = serde_json::to_value(stage).unwrap_or_default();
                data.to_string()
            }
            None => "null".to_owned(),
        };
        let replay = match self.replay {
            Some(_) => REPLAY,
            None => "",
        };
        let title = escaped(self.title);
        let parts = [
            ("title", title.as_str()),
            ("style", STYLE),
            ("lead", &lead_html(&self.lead)),
            ("replay", replay),
            ("sections", &sections),
            ("data", &in_script(&data)),
            ("script", &SCRIPTS.concat()),
        ];
        Ok(filled(PAGE, &parts))
    }
}

/// `template` with each `{{name}}` replaced once: what is put in is not looked through again.
fn filled(template: &str, parts: &[(&str, &str)]) -> String {
    let mut out = String::new();
    for (k, piece) in template.split("{{").enumerate() {
        match piece.split_once("}}").filter(|_| k > 0) {
            Some((name, rest)) => {
                let part = parts.iter().find(|part| part.0 == name);
                out.push_str(part.map_or("", |part| part.1));
                out.push_str(rest);
            }
            None => out.push_str(piece),
        }
    }
    out
}

fn lead_html(lead: &Lead) -> String {
    let class = if lead.good { "lead" } else { "lead bad-run" };
    format!(
        "<div class=\"{class}\" id=\"lead\">\n<p><b>What came out</b> {}</p>\n\
         <p><b>Trust</b> {}</p>\n<p><b>What to do</b> {}</p>\n</div>\n",
        escaped(&lead.what_came_out),
        escaped(&lead.can_it_be_trusted),
        escaped(&lead.what_to_do)
    )
}

fn section_html(section: &Section) -> Result<String, ReportError> {
    let mut out = String::new();
    let head = |title: &str| format!("<section>\n<h2>{}</h2>\n", escaped(title));
    match section {
        Section::Charts { title, charts } => {
            out.push_str(&head(title));
            out.push_str("<div class=\"charts\">\n");
            for chart in charts {
                out.push_str(&figure(&Panel::of(chart)?));
            }
            out.push_str("</div>\n");
        }
        Section::Table {
            title,
            header,
            rows,
        } => {
            out.push_str(&head(title));
            out.push_str("<div class=\"wide\"><table>\n<tr>");
            for cell in header {
                let _ = write!(out, "<th>{}</th>", escaped(cell));
            }
            out.push_str("</tr>\n");
            for row in rows {
                out.push_str("<tr>");
                for cell in row {
                    let class = if cell == "no" {
                        " class=\"failed\""
                    } else {
                        ""
                    };
                    let _ = write!(out, "<td{class}>{}</td>", escaped(cell));
                }
                out.push_str("</tr>\n");
            }
            out.push_str("</table></div>\n");
        }
        Section::List { title, items } => {
            out.push_str(&head(title));
            out.push_str("<ul>\n");
            for item in items {
                let _ = writeln!(out, "<li>{}</li>", escaped(item));
            }
            out.push_str("</ul>\n");
        }
        Section::Pictures { title, pictures } => {
            out.push_str(&head(title));
            out.push_str("<div class=\"pictures\">\n");
            for (caption, svg) in pictures {
                let _ = write!(
                    out,
                    "<figure><div class=\"wide\">\n<svg style=\"min-width:{}px\"{}</div><figcaption><span>{}</span></figcaption></figure>\n",
                    (SMALLEST * size(svg, "width")).ceil(),
                    inline(svg).trim_start_matches("<svg"),
                    escaped(caption)
                );
            }
            out.push_str("</div>\n");
        }
        Section::Text { title, text } => {
            // lines stay lines
            let lines: Vec<String> = text.lines().map(escaped).collect();
            let _ = writeln!(out, "{}<pre>{}</pre>", head(title), lines.join("\n"));
        }
    }
    out.push_str("</section>\n");
    Ok(out)
}

fn figure(panel: &Panel) -> String {
    let mut legend = String::new();
    for (name, colour) in &panel.legend {
        let name = escaped(name);
        let _ = write!(legend, "<span style=\"color:{colour}\">━ {name}</span> ");
    }
    let mut notes = String::new();
    for note in &panel.notes {
        let _ = write!(notes, "<p class=\"small\">{}</p>", escaped(note));
    }
    format!(
        "<figure><figcaption>{}<br>{legend}</figcaption>\n\
         <div class=\"plot\" data-left=\"{:.5}\" data-right=\"{:.5}\" data-from=\"{}\" data-to=\"{}\">{}<i></i></div>{notes}</figure>\n",
        escaped(&panel.title),
        panel.left,
        panel.right,
        panel.from,
        panel.to,
        panel.svg
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    fn page(title: &str, sections: Vec<Section>) -> String {
        let lead = Lead {
            good: true,
            what_came_out: title.to_owned(),
            can_it_be_trusted: title.to_owned(),
            what_to_do: title.to_owned(),
        };
        let page = Page {
            title,
            lead,
            replay: None,
            sections,
        };
        page.to_html().unwrap()
    }

    #[test]
    fn what_a_user_wrote_is_text_and_no_template() {
        let text = "</script><b>&{{script}}{{data}}";
        let html = page(
            text,
            vec![
                Section::List {
                    title: text.to_owned(),
                    items: vec![text.to_owned()],
                },
                Section::Text {
                    title: text.to_owned(),
                    text: text.to_owned(),
                },
                Section::Table {
                    title: text.to_owned(),
                    header: vec![text.to_owned()],
                    rows: vec![vec![text.to_owned()]],
                },
            ],
        );
        assert_eq!(html.matches("</script>").count(), 2);
        assert!(!html.contains("<b>&"));
        let safe = "&lt;/script&gt;&lt;b&gt;&amp;{{script}}{{data}}";
        // the page's title twice, three sentences, three titles of sections, and one item, one text,
        // two cells
        assert_eq!(html.matches(safe).count(), 5 + 3 + 4);
    }

    #[test]
    fn a_page_without_motion_has_no_replay() {
        let html = page("a life", Vec::new());
        assert!(!html.contains("<canvas") && html.contains(">null</script>"));
    }
}
