use super::{
    Entry, chains, crowds, friction, impacts, machines, masonry, redundancy, rods, scales, stacks,
};

const LATE_BOUNCES: &str = "its bounces fall within 80 steps, each taken at the end of a step; \
    where impacts are located (`events`) the time is exact";

const TREMBLES: &str = "a link of length L and moment of inertia I trembles under the pull T at \
    sqrt(T L/I), which a step that holds the pull's direction follows below 2/dt only: 336 rad/s \
    against 120 for a thousandfold weight at 1/60 s; it holds up to 125 links' weight at 1/60 s, up \
    to 500 at 1/120 s, a thousand at 1/240 s";

const STRIKES: &str = "hung still its links tremble at 106 rad/s, close to the 120 that 1/60 s \
    follows; when it swings and strikes the pull is more, and gaps of pins grow over some six steps \
    to 0.11 % of the length, for 3 steps of 300 above the limit; at 1/120 s they stay below 0.003 %";

const BALL: &str = "the links of 6 kg and 0.75 kg m² tremble under the ball's weight at 230 rad/s, at \
    the bottom of its swing at 400, and a step follows 2/dt, 120 rad/s at 1/60 s and 240 at 1/120 s; \
    it holds at 1/240 s";

const PLANKS: &str = "after boxes strike, gaps of pins grow over some six steps to 0.11 % (10 planks) and \
    0.17 % (20) of the length and are closed in the next, for 1 and 3 steps of 300 above the limit; \
    at 1/120 s they stay below 0.02 %";

const SWEPT: &str = "the end of the bar moves by 0.1 m and more in a step and turns as it does; the \
    depth falls by four to thirteen with every halving of the step";

const POURS: &str = "grains that come at half a radius and more a step are noticed when they are in \
    each other already: 22 mm at 1/60 s, where 1/120 s leaves 1e-8 m";

const FALLS: &str = "grains that fall at 2.6 m/s move nearly two radii in a step of 1/60 s, and are noticed \
    when they are in each other already: 16 mm of 50 at 1/60 s, \
    10 at 1/120, 1.1 at 1/240, 0.2 at 1/500";

const MODELS: &str = "4.00 m/s at 1/60 s; ours converges to 4.13 and rapier's stiff preset to 4.32, and \
    the reference is their mean, for want of one from outside";

const CROWD: &str = "in a few steps of 600 one island of hundreds of contacts that close from all \
    sides is not certified, and the step says so";

/// Every entry, in the order of the picture.
pub const ENTRIES: &[Entry] = &[
    Entry {
        name: "heavy-on-light",
        shows: "a load much heavier than what carries it",
        passes: "10 s: penetration below 1e-4 of the box, the heavy one moves below 1e-3",
        rungs: stacks::heavy_on_light,
        ours: &[],
    },
    Entry {
        name: "tower",
        shows: "a tall stack",
        passes: "10 s: lean and sinking below 1e-3 of the height, penetration below 1e-4 of a box",
        rungs: stacks::tower,
        ours: &[],
    },
    Entry {
        name: "pyramid",
        shows: "a stack with many ways for the load",
        passes: "as the tower",
        rungs: stacks::pyramid,
        ours: &[],
    },
    Entry {
        name: "inverted-pyramid",
        shows: "a stack that gets wider and stands on one box",
        passes: "as the tower",
        rungs: stacks::inverted_pyramid,
        ours: &[],
    },
    Entry {
        name: "arch",
        shows: "an arch near the least thickness that stands, dated by the equilibrium oracle",
        passes: "stands (1e-3 of the radius) above it, falls (1e-2) below",
        rungs: masonry::arch,
        ours: &[],
    },
    Entry {
        name: "card-house",
        shows: "cards near the least friction that holds them, dated by the equilibrium oracle",
        passes: "stands (1e-3 of a storey) above it, falls (1e-2) below",
        rungs: masonry::card_house,
        ours: &[],
    },
    Entry {
        name: "overhang",
        shows: "blocks over the edge of a table, 2 % less and more than the harmonic sum",
        passes: "stands (1e-3 of a block) inside, falls (1e-2) outside",
        rungs: masonry::overhang,
        ours: &[],
    },
    Entry {
        name: "wedge",
        shows: "a wedge under a heavy lid, by its half angle's tangent",
        passes: "stays (1e-3 of it) where friction locks it, slips (1e-2) where not; shares flagged",
        rungs: masonry::wedge,
        ours: &[],
    },
    Entry {
        name: "redundant-contacts",
        shows: "up to a thousand points under one face, and points of polylines found twice",
        passes: "holds still within 1 mm under the weights' wrench within 1e-3",
        rungs: redundancy::redundant_contacts,
        ours: &[],
    },
    Entry {
        name: "painleve",
        shows: "a rod that slides on its tip with too much friction for a sliding force",
        passes: "jams within two steps above the threshold, slides below; energy rises below 1e-6",
        rungs: rods::painleve,
        ours: &[],
    },
    Entry {
        name: "kane",
        shows: "impacts with friction to which Newton's law gives energy, by law, restitution, friction",
        passes: "newton: the gain of contacts is reported to 1e-9; default: none beyond 1e-3 (the pins')",
        rungs: rods::kane,
        ours: &[],
    },
    Entry {
        name: "zeno-ball",
        shows: "infinitely many bounces in finite time",
        passes: "at rest at the right time within 4 %",
        rungs: impacts::zeno_ball,
        ours: &[("e 0.5", LATE_BOUNCES)],
    },
    Entry {
        name: "stick-slip-incline",
        shows: "a block a thousandth and a hundredth below and above the angle of friction",
        passes: "creep below 1e-6 m in 10 s; acceleration within 1 %",
        rungs: friction::stick_slip_incline,
        ours: &[],
    },
    Entry {
        name: "sliding-lift-off",
        shows: "a block that slides fast, which convex relaxations of friction lift",
        passes: "gap below 1e-6 m",
        rungs: friction::sliding_lift_off,
        ours: &[],
    },
    Entry {
        name: "ghost-edges",
        shows: "a slider without friction over the joints of a polyline",
        passes: "speed within 1e-6, height within 1e-5 m",
        rungs: friction::ghost_edges,
        ours: &[],
    },
    Entry {
        name: "bullet",
        shows: "bodies that cross a wall of 1 cm within a step, and bars that spin fast",
        passes: "does not tunnel, no energy gained; penetration stated",
        rungs: impacts::bullet,
        ours: &[],
    },
    Entry {
        name: "initial-overlap",
        shows: "bodies that start in each other",
        passes: "apart within 1 mm after 10 s, or says it cannot; kinetic energy below 1e-3 m g L",
        rungs: impacts::initial_overlap,
        ours: &[],
    },
    Entry {
        name: "far-origin",
        shows: "tower and incline far from the origin",
        passes: "as at the origin",
        rungs: scales::far_origin,
        ours: &[],
    },
    Entry {
        name: "tiny-and-huge",
        shows: "tower and incline of 1 mm and 100 m",
        passes: "as at 1 m, lengths scaled",
        rungs: scales::tiny_and_huge,
        ours: &[],
    },
    Entry {
        name: "heavy-end",
        shows: "a chain with a weight in contact with a wall, by its mass over a link's",
        passes: "stretch below 1e-3, energy rises by less than lifts all by 1 cm",
        rungs: chains::heavy_end,
        ours: &[
            ("leans 1000, 1/60", TREMBLES),
            ("swings 100, 1/60", STRIKES),
            ("swings 1000, 1/60", TREMBLES),
        ],
    },
    Entry {
        name: "spinner",
        shows: "a bar turns among fifty discs in a ring",
        passes: "none escapes, mean square speed within 25 % of converged runs, penetration below 1 % of a disc",
        rungs: machines::spinner,
        ours: &[("1 rad/s", SWEPT), ("3 rad/s", SWEPT)],
    },
    Entry {
        name: "gears",
        shows: "a wheel drives another by its teeth, by their numbers",
        passes: "driver within 5 % of its motor's speed, no tooth skipped, penetration below 5 mm",
        rungs: machines::gears,
        ours: &[],
    },
    Entry {
        name: "ratchet",
        shows: "a pawl lets a wheel turn one way",
        passes: "turns within 20 % of its motor's speed, locks within a tooth; penetration below 5 mm",
        rungs: machines::ratchet,
        ours: &[],
    },
    Entry {
        name: "dominoes",
        shows: "a wave of dominoes",
        passes: "wave within 5 % of the converged speed, no energy gained",
        rungs: machines::dominoes,
        ours: &[("0.4 m apart", MODELS)],
    },
    Entry {
        name: "granular-drum",
        shows: "two hundred discs in a turning drum",
        passes: "mean angle of the heap within 0.04 rad of converged runs, penetration below 1 %",
        rungs: machines::granular_drum,
        ours: &[("1/60 s", FALLS)],
    },
    Entry {
        name: "hopper",
        shows: "180 discs run out of a funnel",
        passes: "discharge within 15 % of converged runs, penetration below 1 %",
        rungs: machines::hopper,
        ours: &[("1 m", POURS), ("1.4 m", POURS)],
    },
    Entry {
        name: "friction-ramp",
        shows: "boxes of six frictions on a ramp of 0.25 rad",
        passes: "holds within 1e-4 m in 4 s, or slides as far as it must within 1 %",
        rungs: friction::friction_ramp,
        ours: &[],
    },
    Entry {
        name: "rush",
        shows: "discs that springs pull to one point",
        passes: "penetration below 1 % of a disc, at rest (0.05 m/s) in 10 s, contacts give no energy",
        rungs: crowds::rush,
        ours: &[("100", CROWD), ("400", CROWD)],
    },
    Entry {
        name: "confined",
        shows: "discs that start in each other, in a box with room for them and without",
        passes: "kinetic energy below 1e-2 of a disc's at 1 m/s; none escapes",
        rungs: crowds::confined,
        ours: &[],
    },
    Entry {
        name: "bridge",
        shows: "planks that hang between two banks under falling boxes",
        passes: "stretch below 1e-3, penetration below 1e-2 of a box, energy as above",
        rungs: chains::bridge,
        ours: &[("10", PLANKS), ("20", PLANKS)],
    },
    Entry {
        name: "ball-and-chain",
        shows: "a ball 670 times as heavy as a link swings on forty links",
        passes: "energy and stretch as above",
        rungs: chains::ball_and_chain,
        ours: &[("1/60 s", BALL)],
    },
    Entry {
        name: "joint-grid",
        shows: "a net of pinned discs hangs by its edge",
        passes: "stretch and energy as above",
        rungs: chains::joint_grid,
        ours: &[],
    },
];
