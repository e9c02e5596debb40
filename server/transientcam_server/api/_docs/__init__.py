"""The documentation that the service serves: OpenAPI pages, AsyncAPI, pages of problems."""
