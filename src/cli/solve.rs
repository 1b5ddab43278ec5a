use super::{Flags, Outcome, effect, print_err, print_out, summary, tolerance};
use crate::contact::{BlockMatrix, ContactProblem, Delassus, Law, Vec2, natural_map};
use crate::experiment::RunError;
use crate::oracles::{SOLVERS, solver_by_name};
use crate::oracles::{complementarity_residual, solve_lcp};
use crate::problems::{FileError, Loaded, StoredProblem, read};
use crate::report::{OutputFolder, ReportError, counted, number};
use crate::scene::Hint;
use crate::solver::{LcpOptions, LcpStatus, SolveReport};
use crate::solver::{Shares, Sharing, Uniqueness};
use clap::Args;
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use std::path::{Path, PathBuf};

#[derive(Args)]
pub(super) struct SolveArgs {
    /// Problem file, JSON or .dat text; the content decides which.
    file: PathBuf,
    /// Impulse solver: auto, enumeration, nsgs, direct, lemke or prox; always lemke for an LCP.
    #[arg(long, value_name = "NAME", default_value = "auto", value_parser = known_solver)]
    solver: String,
    /// Relative residual at which the problem counts as solved, 1e-15 to 1e-2.
    #[arg(long, value_name = "R", default_value = "1e-8", value_parser = tolerance,
          allow_hyphen_values = true)]
    tolerance: f64,
    /// Which impulses to return if they are not unique: found (those of the solver) or minimum-norm
    /// (those of least norm) [default: found].
    #[arg(long, value_name = "NAME", value_parser = shares)]
    shares: Option<Shares>,
    /// Write the result to this file, as JSON.
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Print the result as JSON in place of the description.
    #[arg(long)]
    json: bool,
    /// Print nothing.
    #[arg(long)]
    quiet: bool,
}

/// Limit of Lemke's method in multiplications, some ten seconds: its path can be exponential. The
/// same limit applies again after a ray.
const LCP_WORK: f64 = 2e10;

/// Most corrections of a solution for the asymmetry of the operator in the file. Each leaves a share
/// of the last error that is about the asymmetry, at most 1e-5 of a well-conditioned operator.
const CORRECTIONS: usize = 5;

fn known_solver(name: &str) -> Result<String, String> {
    if SOLVERS.contains(&name) {
        return Ok(name.to_owned());
    }
    Err(format!("unknown solver{}", Hint::new(name, SOLVERS)))
}

fn shares(name: &str) -> Result<Shares, String> {
    let all = [Shares::Found, Shares::MinimumNorm];
    all.into_iter()
        .find(|s| s.name() == name)
        .ok_or_else(|| format!("unknown{}", Hint::new(name, all.map(Shares::name))))
}

/// The result as JSON.
#[derive(Serialize)]
struct Written<'a> {
    #[serde(flatten)]
    found: &'a Found,
    tolerance: f64,
    warnings: &'a [String],
}

#[derive(Serialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
enum Found {
    Contact {
        blocks: usize,
        solver: String,
        status: &'static str,
        iterations: ContactWork,
        residual: f64,
        residual_velocity_m_s: f64,
        shares: &'static str,
        self_stress: Option<usize>,
        steep_contacts: Option<Vec<usize>>,
        impulses: Vec<f64>,
    },
    Lcp {
        size: usize,
        solver: &'static str,
        status: &'static str,
        iterations: LcpWork,
        residual: f64,
        z: Vec<f64>,
        w: Vec<f64>,
        /// Proof that there is no solution.
        #[serde(skip_serializing_if = "Option::is_none")]
        certificate: Option<Vec<f64>>,
    },
}

#[derive(Serialize)]
struct ContactWork {
    sweeps: usize,
    factorisations: usize,
    pivots: usize,
}

#[derive(Serialize)]
struct LcpWork {
    pivots: usize,
    paths: usize,
    programmes: usize,
}

/// A result: as JSON, as text for the terminal, and whether the problem is solved.
struct Solved {
    result: Found,
    text: String,
    solved: bool,
}

/// Reads a problem, solves it and judges the solution by its residual.
pub(super) fn solve(args: &SolveArgs) -> Result<Outcome, RunError> {
    let path = &args.file;
    let of_file = |source| RunError::Problem {
        path: path.clone(),
        source,
    };
    let bytes = std::fs::read(path).map_err(|source| ReportError::Io {
        path: path.clone(),
        source,
    })?;
    let Loaded {
        problem,
        as_read,
        warnings,
    } = read(&bytes).map_err(of_file)?;
    if let Some(out) = &args.out
        && let (Ok(a), Ok(b)) = (out.canonicalize(), path.canonicalize())
        && a == b
    {
        return Err(RunError::Unfit(format!(
            "--out {}: is the problem file itself; a result does not overwrite its problem",
            out.display()
        )));
    }
    refuse_idle(args, &problem)?;
    let out = args.out.as_deref().map(Target::create).transpose()?;
    let solved = match &problem {
        StoredProblem::Contact { problem, solution } => {
            contact(args, problem, as_read, solution.as_deref())
        }
        StoredProblem::Lcp {
            matrix,
            q,
            solution,
        } => {
            if !["auto", "lemke"].contains(&args.solver.as_str()) {
                return Err(RunError::Unfit(format!(
                    "--solver {}: solves contact problems; {} is an LCP, which lemke solves",
                    args.solver,
                    path.display()
                )));
            }
            lcp(args, matrix, q, solution.as_ref()).map_err(of_file)?
        }
    };
    let written = Written {
        found: &solved.result,
        tolerance: args.tolerance,
        warnings: &warnings,
    };
    let json = format!("{:#}\n", summary::json(written));
    if let Some(out) = out {
        out.write(&json)?;
    }
    if args.json {
        print_out(&json)?;
    } else if !args.quiet {
        for warning in &warnings {
            print_err(&format!("warning: {warning}\n"));
        }
        print_out(&format!("{}: {}", path.display(), solved.text))?;
    }
    Ok(if solved.solved {
        Outcome::Done
    } else {
        Outcome::Failed
    })
}

/// Refuses flags that have no effect on the problem.
fn refuse_idle(args: &SolveArgs, problem: &StoredProblem) -> Result<(), RunError> {
    let subject = match problem {
        StoredProblem::Contact { .. } => effect::Subject::Problems,
        StoredProblem::Lcp { .. } => effect::Subject::Lcp,
    };
    let run = effect::Run {
        tables: !args.json,
        ..effect::Run::of_problems("solve", subject)
    };
    let mut typed = Vec::new();
    if let Some(shares) = args.shares {
        typed.push(("--shares", shares.name().to_owned()));
    }
    if args.quiet {
        typed.push(("--quiet", String::new()));
    }
    run.refuse(&Flags::default(), &typed)
}

/// Solves `problem` with the solver of `args`. Returns the work, and whether shares of least norm
/// were found. If the file has another operator, `G_read = G + A`, the problem is solved again with
/// `b + A P` until the solution is certified for `as_read`.
fn work_of(
    args: &SolveArgs,
    problem: &ContactProblem,
    as_read: Option<&ContactProblem>,
    impulses: &mut [Vec2],
) -> (Option<SolveReport>, bool) {
    // the name was checked when it was parsed
    let Some(mut solver) = solver_by_name(&args.solver) else {
        return (None, false);
    };
    let least_norm = args.shares == Some(Shares::MinimumNorm);
    let mut solve = |posed: &ContactProblem, impulses: &mut [Vec2]| {
        let report = solver.solve(posed, impulses, args.tolerance);
        let mut sharing = Sharing::default();
        let least = least_norm && sharing.least(posed, impulses, args.tolerance).0;
        (report, least)
    };
    let (mut total, mut least) = solve(problem, impulses);
    let Some(as_read) = as_read else {
        return (Some(total), least);
    };
    let mut posed = problem.clone();
    for _ in 0..CORRECTIONS {
        if !total.solved() || natural_map(as_read, impulses).certified(args.tolerance) {
            break;
        }
        let both = [as_read, problem].map(|p| p.operator.apply(impulses));
        for (k, b) in posed.free.iter_mut().enumerate() {
            *b = problem.free[k] + both[0][k] - both[1][k];
        }
        let again = solve(&posed, impulses);
        (total, least) = (again.0.after(&total), again.1);
    }
    (Some(total), least)
}

fn contact(
    args: &SolveArgs,
    problem: &ContactProblem,
    as_read: Option<BlockMatrix>,
    stored: Option<&[Vec2]>,
) -> Solved {
    let mut impulses = vec![Vec2::zeros(); problem.len()];
    let as_read = as_read.map(|matrix| ContactProblem {
        operator: Delassus::Blocks(matrix),
        ..problem.clone()
    });
    let (worked, least) = work_of(args, problem, as_read.as_ref(), &mut impulses);
    let judged = as_read.as_ref().unwrap_or(problem);
    let residual = natural_map(judged, &impulses);
    let solved = residual.certified(args.tolerance);
    let status = if solved { "solved" } else { "unsolved" };
    let (sweeps, factorisations, pivots) =
        worked.map_or((0, 0, 0), |r| (r.sweeps, r.factorisations, r.pivots));
    let mut text = format!(
        "contact problem, {}\nsolver {}: {status}; {sweeps} sweeps, {factorisations} \
         factorisations, {pivots} pivots\nnatural-map residual {} (relative), {} m/s of {} m/s; \
         tolerance {:e}\n",
        blocks(problem),
        args.solver,
        number(residual.relative, 3),
        number(residual.velocity, 3),
        number(residual.velocity_scale, 3),
        args.tolerance,
    );
    if !solved && sweeps + factorisations + pivots == 0 {
        text.push_str(&format!(
            "{} does not accept problems of this size: nothing was tried\n",
            args.solver
        ));
    }
    let unique = solved.then(|| Uniqueness::of(problem, &impulses));
    if let Some(unique) = &unique {
        text.push_str(&uniqueness(unique, args.shares.unwrap_or_default(), least));
    }
    if let Some(stored) = stored {
        let residual = natural_map(judged, stored).relative;
        let residual = number(residual, 3);
        text.push_str(&format!(
            "the solution in the file has residual {residual}\n"
        ));
    }
    let result = Found::Contact {
        blocks: problem.len(),
        solver: args.solver.clone(),
        status,
        iterations: ContactWork {
            sweeps,
            factorisations,
            pivots,
        },
        residual: residual.relative,
        residual_velocity_m_s: residual.velocity,
        shares: if least {
            Shares::MinimumNorm
        } else {
            Shares::Found
        }
        .name(),
        self_stress: unique.as_ref().and_then(|u| u.self_stress),
        steep_contacts: unique.map(|u| u.steep),
        impulses: impulses.iter().flat_map(|p| [p.x, p.y]).collect(),
    };
    Solved {
        result,
        text,
        solved,
    }
}

/// Describes which parts of a solution are not unique.
fn uniqueness(unique: &Uniqueness, shares: Shares, least: bool) -> String {
    let mut text = match unique.self_stress {
        Some(0) => "the impulses are unique while no contact changes its status\n".to_owned(),
        Some(k) => format!(
            "the impulses are not unique: {k} independent ways to distribute the load; {}\n",
            match (shares, least) {
                (Shares::Found, _) => {
                    "those of the solver (--shares minimum-norm gives those of least norm)"
                }
                (Shares::MinimumNorm, true) => "those of least norm",
                (Shares::MinimumNorm, false) => "none of smaller norm were found",
            }
        ),
        None => format!(
            "too many closed rows to decide whether the impulses are unique{}\n",
            match (shares, least) {
                (Shares::Found, _) => "",
                (Shares::MinimumNorm, true) => "; those of least norm",
                (Shares::MinimumNorm, false) => "; none of smaller norm were found",
            }
        ),
    };
    if !unique.steep.is_empty() {
        let list: Vec<String> = unique.steep.iter().take(5).map(usize::to_string).collect();
        let more = if unique.steep.len() > 5 { ", ..." } else { "" };
        text.push_str(&format!(
            "the motion may not be unique: friction reaches Painleve's limit in {} contacts \
             (counted from 0: {}{more})\n",
            unique.steep.len(),
            list.join(", "),
        ));
    }
    text
}

/// Number of blocks of each law, as text.
fn blocks(problem: &ContactProblem) -> String {
    let count = |of: fn(&Law) -> bool, one: &str| {
        let n = problem.laws.iter().filter(|law| of(law)).count();
        counted(n, one)
    };
    let mut parts = vec![count(|law| matches!(law, Law::Contact { .. }), "contact")];
    parts.push(count(|law| matches!(law, Law::Pin), "pin"));
    parts.push(count(
        |law| matches!(law, Law::Bounded { .. }),
        "bounded row",
    ));
    // the number of contacts is always shown, other numbers only above 0
    let mut first = true;
    parts.retain(|part| std::mem::take(&mut first) || !part.starts_with("0 "));
    parts.join(", ")
}

fn lcp(
    args: &SolveArgs,
    matrix: &DMatrix<f64>,
    q: &DVector<f64>,
    stored: Option<&DVector<f64>>,
) -> Result<Solved, FileError> {
    let n = q.len();
    let pivot = 2.0 * (n * n).max(1) as f64;
    let mut options = LcpOptions {
        tolerance: args.tolerance,
        ..LcpOptions::default()
    };
    // large problems use the default limit of the method; small ones may follow an exponential path
    options.max_pivots = options.max_pivots.max((LCP_WORK / pivot) as usize);
    let found = solve_lcp(matrix, q, &options).map_err(|e| FileError::Content(e.to_string()))?;
    let residual = complementarity_residual(matrix, q, &found.z);
    let end = match found.status {
        LcpStatus::Solved if residual > args.tolerance => LcpStatus::Inaccurate,
        end => end,
    };
    let (status, explanation) = in_words(end, found.exhausted);
    let mut text = format!(
        "LCP of size {n}\nsolver lemke: {status}; {} pivots, {} paths, {} linear programmes\n\
         complementarity residual max |min(m z, w)| / max(max(-q), m max z) = {}, m the mean of \
         |M_ii|; tolerance {:e}\n{explanation}",
        found.pivots,
        found.paths,
        found.programmes,
        number(residual, 3),
        args.tolerance,
    );
    if let Some(z) = stored {
        let residual = number(complementarity_residual(matrix, q, z), 3);
        text.push_str(&format!(
            "the solution in the file has residual {residual}\n"
        ));
    }
    let list = |x: &DVector<f64>| x.iter().copied().collect::<Vec<f64>>();
    let result = Found::Lcp {
        size: n,
        solver: "lemke",
        status,
        iterations: LcpWork {
            pivots: found.pivots,
            paths: found.paths,
            programmes: found.programmes,
        },
        residual,
        z: list(&found.z),
        w: list(&found.w),
        certificate: found.certificate.as_ref().map(list),
    };
    Ok(Solved {
        result,
        text,
        solved: end == LcpStatus::Solved,
    })
}

/// A status as the JSON spells it, and its explanation for the terminal.
fn in_words(end: LcpStatus, exhausted: bool) -> (&'static str, &'static str) {
    match end {
        LcpStatus::Solved => ("solved", ""),
        LcpStatus::Ray if exhausted => (
            "ray",
            "not solved: every path ended on a ray and a search through all complementary bases \
             found no solution; apart from round-off there is none\n",
        ),
        LcpStatus::Ray => (
            "ray",
            "not solved: every path ended on a ray and no proof was found that there is no \
             solution; if M is copositive-plus (positive semidefinite, say), there is none\n",
        ),
        LcpStatus::Infeasible => (
            "infeasible",
            "no solution: there is y >= 0 with M^T y <= 0 and q^T y < 0, so that no z >= 0 has \
             M z + q >= 0\n",
        ),
        LcpStatus::PivotLimit => (
            "pivot-limit",
            "not solved: the method reached its limit of pivots; its path can be exponential\n",
        ),
        LcpStatus::Inaccurate => (
            "inaccurate",
            "not solved: round-off keeps the residual of the basis found above the tolerance\n",
        ),
    }
}

/// A single output file, written completely or not at all.
struct Target {
    folder: OutputFolder,
    name: String,
}

impl Target {
    fn create(path: &Path) -> Result<Target, RunError> {
        let name = path.file_name().and_then(|name| name.to_str());
        let name = name.filter(|_| !path.is_dir()).ok_or_else(|| {
            let path = path.to_path_buf();
            RunError::Report(ReportError::IsAFolder { path })
        })?;
        Ok(Target {
            folder: OutputFolder::create(path.parent().unwrap_or(Path::new("")))?,
            name: name.to_owned(),
        })
    }

    fn write(self, text: &str) -> Result<(), RunError> {
        self.folder.write(&self.name, text)?;
        self.folder.commit()?;
        Ok(())
    }
}
