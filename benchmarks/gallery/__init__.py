"""A gallery with images of all bodies, motions and scenes, and a page that shows them."""
