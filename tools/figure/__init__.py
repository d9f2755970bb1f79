"""Makes the figures that come with fba: heads, bodies, their levels of detail and light."""
