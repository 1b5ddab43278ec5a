#!/bin/sh
#SBATCH --array=1-6
#SBATCH --cpus-per-task=1
moreau2d sweep plan.toml --out cases
