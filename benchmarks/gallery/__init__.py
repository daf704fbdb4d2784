"""A gallery with pictures of every body, motion and scene, and a page that shows them."""
