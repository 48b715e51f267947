"""Training a gait: rsl_rl's PPO on `gaitshift.sim.env`, flat first, then rough with pushes."""
