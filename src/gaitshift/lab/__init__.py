"""Experiments: logs, rollouts, gait figures, trials, identification, studies, benchmarks."""
