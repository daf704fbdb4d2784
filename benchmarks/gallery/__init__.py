"""The gallery: pictures of every body, every motion and every scene, and a page that shows them."""
