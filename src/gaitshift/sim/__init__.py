"""The simulation: the ground, MuJoCo's world, the reward, the environment."""
