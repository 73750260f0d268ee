"""What a landing vehicle believes of its place above the platform."""
