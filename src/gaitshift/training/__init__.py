"""Training a gait: rsl_rl's PPO on `gaitshift.env`, flat ground first, then rough with pushes."""
