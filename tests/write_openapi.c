/* Writes the OpenAPI document to standard output; `make openapi` keeps it in server/openapi.yaml. */
#include <stdio.h>

#include "proto/operation/operation.h"
#include "server/api/openapi.h"

int main(void)
{
	struct gnp_buffer buffer = {0};
	struct gnp_error error = {0};
	if (gnpd_openapi_write(&buffer, &error) != GNP_OK) {
		fprintf(stderr, "write_openapi: %s\n", error.text);
		return 1;
	}
	fwrite(buffer.data, 1, buffer.size, stdout);
	gnp_buffer_clear(&buffer);
	return fflush(stdout) == 0 ? 0 : 1;
}
