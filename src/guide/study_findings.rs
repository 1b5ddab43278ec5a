//! The published study of tooth wear, rebuilt: what agrees, what cannot, and why.
//!
//! Ibrahim, Shash & Abboud, *Dynamic simulation of abrasive wear in grain threshing units*, DYSONA - Applied
//! Science 6(1), 2025, doi 10.30493/das.2024.485466. `moreau2d run thresher-study` writes each of its figures
//! beside its published numbers, and `moreau2d sweep scenes/sweeps/thresher-study.toml` all of its torques,
//! speeds and six frictions, 144 lives at one contact time that is held.
//!
//! One constant is fitted, the contact time of a load cycle, to one published depth: 7.62 mm at 146.39 N m and
//! 70 rad/s after 4e6 cycles. Everything else below was not.
//!
//! | figure of the study | picture | table |
//! |---|---|---|
//! | depth over speed, two torques | `depth-over-speed.svg` | `comparison.csv` |
//! | life over friction | `life-over-friction.svg` | `friction.csv` |
//! | depth over friction, 20.87 to 54.37 N m | `depth-over-friction.svg` | `friction-depth.csv` |
//! | depth of each cell | `depth-per-cell.svg` | `wear.csv` |
//! | worn profiles | `worn-profile.svg`, without published ones: the study does not print them | `profile.csv` |
//!
//! # What agrees
//! | finding | published | here | test |
//! |---|---|---|---|
//! | depth over torque, 20.87 to 146.39 N m at 70 rad/s | 6.7 times | 6.0 times | `the_depths_agree_up_to_the_kinks_and_no_power_law_has_those` |
//! | depth over speed up to 100 rad/s at 146.39 N m | linear, +30 % | linear, +35 %; each depth within 4.5 % | the same |
//! | all eleven points that were not fitted | | 11.6 % off on average, 29.9 % at most | `the_study_reproduces_the_winkler_row_of_the_rebuilt_data` |
//! | the literal equations stall in one step | not said | shown: wear goes as torque to the 0, speed squared | `the_literal_reading_stalls_in_one_step` |
//!
//! # What cannot agree, and why
//! | finding | published | here | why | test |
//! |---|---|---|---|---|
//! | depth at 110 and 120 rad/s, 146.39 N m | 13.40 and 17.07 mm | 11.12 and 11.97 mm | kinks that nothing in the model makes; a power law of torque and speed that is fitted to all twelve points misses them too | `the_depths_agree_up_to_the_kinks_and_no_power_law_has_those` |
//! | wear over friction | rises: 0.49-0.72 to 2.57-2.85 mm from 0.14 to 0.40 | falls | the torque is given: what friction takes of it leaves less normal force, however the cells share the load | `friction_acts_the_other_way_in_every_sharing_of_the_load` |
//! | life over friction | 64, 27, 31, 14, 20 h: reverses three times | 111 to 226 h, rises | a law of one sign gives no reversals; abstract and conclusions of the study differ as well | the same |
//! | depth over 20.87 to 54.37 N m at one friction | within a factor of 1.46 | 2.6 times | wear goes with the load; the study does not say whether its range is over cells or torques | the same |
//! | deepest cell 6, least 26 | | cell 1 | belongs to an axis distance of 31.6 mm, where the lever of cell 6 vanishes, not to the 0.25 m of a cylinder | `the_sixth_cell_is_deepest_for_the_short_lever_alone` |
//! | shares of the cells in the literal equations | one set | not unique | 26 contacts on one degree of freedom: every single cell alone solves the problem | `every_loading_by_a_single_cell_passes_the_judge` |
//!
//! Life over friction at 146.39 N m and 70 rad/s, the contact time held:
//!
//! | friction | depth after 4e6 cycles \[mm\] | life \[h\] | published life \[h\] |
//! |---|---|---|---|
//! | 0.14 | 11.49 | 111.4 | 64 |
//! | 0.18 | 10.10 | 129.1 | not printed |
//! | 0.25 | 8.46 | 160.0 | 27 |
//! | 0.30 | 7.62, fitted | 182.2 | 31 |
//! | 0.35 | 6.95 | 204.3 | 14, elsewhere 31 |
//! | 0.40 | 6.40 | 226.4 | 20 |
//!
//! The study does not say at which torque and speed its lives are. At the point of the table they do not follow
//! from its own depths: 4e6 cycles are 100 hours at 70 rad/s and wear 7.62 mm of the 12.8 to unfit, so that no life
//! there is as short as 64 hours.
//!
//! # The published torque is not that of a loose crop
//! `moreau2d run thresher-grains` feeds 5.2 kg/s of grains through the machine of `thresher` at 70 rad/s. They take
//! 18 N m of the published 146. The balance of angular momentum about the axle says why (`angular_momentum` of
//! `summary.json`): a loose crop takes about what its mass flow and its own centrifugal force ask for,
//!
//! ```text
//! T = m R [v (1 + mu Theta) - v0] = 5.2 0.25 [17.5 (1 + 0.271 1.92) - 4] = 29 N m
//! ```
//!
//! with the feed m, the tip radius R, the speed of the tips v and of entry v0, friction mu and arc Theta of the
//! concave. The other 117 N m need a crop that is squeezed: 2.5 kPa on the concave. The strip is squeezed by
//! construction, as it neither thins nor outruns its feeder.
//!
//! | N m | grains | strip |
//! |---|---|---|
//! | drive | 18.3 | 147.9 |
//! | held back by the concave | 13.3 | 126.3 |
//! | carried away by the crop | 4.8 | 14.6 |
//! | gravity, feeder, stored | 0.1 | 6.9 |
//! | left over | 0.00 | by difference |
//!
//! The grains are means of nine runs of two revolutions, two seeds with steps of 5 to 15 us. One such run tells the
//! torque to 1.3 N m (their standard deviation; 15.9 to 20.1, no trend with the step).
//!
//! The layer does lie below the tips: as a solid it would be 6.7 mm deep in a gap of 16 to 8 mm, 12 % of the grains
//! above the concave reach within the circle of the tips, and 42 % of those that leave have met a tooth.
//! At half the feed none does, and the torque is 0 (`sweep scenes/sweeps/thresher-grains.toml`, its coarse grains).
//! One run each with grains of 1.1 mm, of 1.2 mm, and of 150 kg/m3 in place of 135, took 18.5, 18.1 and 21.1 N m: they
//! do not tell the effects apart. The estimate is no bound, as impacts press on the concave
//! as well. No loose crop that was tried has a sixth of the published torque: the rest tells of compression,
//! cohesion or losses elsewhere.
//!
//! # What nobody can compare
//! Worn profiles and the photographs they were compared with (errors of 2.01 to 8.93 %) are not in the text, nor
//! is the friction of the speed study. K and the area of a contact act as a quotient alone; depths cannot tell
//! one from the other.
