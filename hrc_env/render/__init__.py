"""Pictures of simulations for users."""
